"""Tells when a marker has moved on its bone, and when it is back: once each, not at every flicker of the flag."""

from dataclasses import dataclass

import numpy as np

from ghest_rt.messages.published import EventKind
from ghest_rt.messages.results import DriftReport, MarkerDrift

# The flag must stand, or be gone, for so long.
_TOLD_AFTER_NS = 500_000_000


@dataclass(slots=True)
class _Flag:
    told: bool = False
    since_ns: int | None = None  # for how long the flag has differed from what was told


class DriftWatch:
    """Remembers what subscribers have been told of each marker."""

    def __init__(self) -> None:
        self._flags = {"m0": _Flag(), "m1": _Flag()}

    def see(self, t_ns: int, report: DriftReport | None) -> list[tuple[str, EventKind, str]]:
        """Take in a sample's report and return what is to be told: marker, kind of event, text.

        Args:
            t_ns: The sample's instant.
            report: Its drift; None leaves everything as it was.
        """
        told: list[tuple[str, EventKind, str]] = []
        if report is None:
            return told
        for marker, drift in (("m0", report.m0), ("m1", report.m1)):
            flag = self._flags[marker]
            if drift.flagged == flag.told:
                flag.since_ns = None
            elif flag.since_ns is None:
                flag.since_ns = t_ns
            elif t_ns - flag.since_ns >= _TOLD_AFTER_NS:
                flag.told, flag.since_ns = drift.flagged, None
                kind = EventKind.MARKER_DRIFTED if drift.flagged else EventKind.MARKER_BACK
                told.append((marker, kind, in_words(drift)))
        return told


def in_words(drift: MarkerDrift) -> str:
    """Return size, direction and certainty of a drift in one line; axes of the marker as calibrated."""
    slide_mm, slide_sigma_mm = drift.slide_m * 1e3, drift.slide_sigma_m * 1e3
    turn_deg, turn_sigma_deg = np.degrees(drift.turn_rad), np.degrees(drift.turn_sigma_rad)
    return (
        f"moved by {np.linalg.norm(slide_mm):.1f} mm ({_terms(slide_mm, slide_sigma_mm)} mm), "
        f"turned by {np.linalg.norm(turn_deg):.1f}° ({_terms(turn_deg, turn_sigma_deg)}°), probability {drift.probability:.2f}"
    )


def _terms(values: np.ndarray, sigmas: np.ndarray) -> str:
    return ", ".join(f"{axis} {value:+.1f} ± {sigma:.1f}" for axis, value, sigma in zip("xyz", values, sigmas, strict=True))
