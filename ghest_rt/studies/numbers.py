"""Numbers as JSON takes them, and as readers do."""

import math
from collections.abc import Mapping

import numpy as np

_SMALL = 0.01


def finite(value: float) -> float | None:
    """Return a number as JSON can hold it: None if it is not finite."""
    return float(value) if math.isfinite(value) else None


def plain(value: object) -> object:
    """Return a value as JSON takes it; what is not finite becomes None."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float | np.floating):
        return finite(float(value))
    if isinstance(value, np.integer):
        return int(value)
    return value


def number(value: float | None, scale: float = 1.0) -> str:
    """Return a number with three digits, fewer below a tenth, or a dash."""
    if value is None or not math.isfinite(value):
        return "–"
    scaled = scale * value
    if abs(scaled) >= 99.95:
        return f"{scaled:.0f}"
    if abs(scaled) >= 0.1:
        return f"{scaled:#.3g}"
    return f"{scaled:.3f}" if abs(scaled) >= _SMALL else f"{scaled:.4f}"


def percent(share: float | None) -> str:
    """Return a share as a percentage; only all of it is 100."""
    if share is None or not math.isfinite(share):
        return "–"
    return "100" if share >= 1.0 else f"{min(99.9, 100.0 * share):.1f}"


def span_in_words(duration_s: float | None) -> str:
    """Say how much of each movement a study played."""
    return "whole movements" if duration_s is None else f"first {duration_s:g} s of each movement"
