"""Medians and percentiles of timings, as every benchmark reports them."""

import numpy as np
from numpy.typing import ArrayLike


def summary_ms(seconds: ArrayLike) -> dict[str, float]:
    """Return median, 90th and 99th percentile in milliseconds."""
    p50, p90, p99 = np.percentile(np.asarray(seconds, dtype=float) * 1e3, (50, 90, 99))
    return {"median_ms": round(float(p50), 4), "p90_ms": round(float(p90), 4), "p99_ms": round(float(p99), 4)}
