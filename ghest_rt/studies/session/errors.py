"""The errors of a run: the paper's RMS and standard deviations (3.4.2, Tables 5 and 6), and what a box plot shows."""

import math
from collections.abc import Iterable, Sequence

import numpy as np

from ghest_rt.messages.results import GhEstimate, TruthSample
from ghest_rt.studies.metrics import ErrorAccumulator
from ghest_rt.studies.truth import TruthTrack

POSE_QUANTITIES = ("m0_m", "m1_m", "position_m", "orientation_deg")
"""Position errors of markers m0 and m1 in E, position and orientation error of the arm in the m0 frame."""


STATISTICS = ("rms", "sd", "mean", "max", "whislo", "q1", "med", "q3", "whishi")
"""What is told of each of them."""


def pose_error_statistics(estimates: Iterable[GhEstimate], truth: Sequence[TruthSample]) -> dict[str, object]:
    """Return the statistics of a run's errors.

    Returns:
        `samples`, `judged`, `valid_fraction`, and for each of `POSE_QUANTITIES` its `rms`, `sd` (of the error's magnitude about
        its mean, as in the parentheses of Tables 5 and 6), `mean`, `max` and the box plot's `whislo`, `q1`, `med`, `q3`,
        `whishi` (quartiles; whiskers at the last error within 1.5 interquartile ranges). None where nothing could be judged.
    """
    track = TruthTrack.of(truth)
    accumulator = ErrorAccumulator()
    found = [accumulator.add(estimate, track.at(estimate.t_sample_ns)) for estimate in estimates]
    errors = [error for error in found if error is not None]
    rms = accumulator.rms()
    columns = {
        "m0_m": ([e.m0_m for e in errors], rms.m0_m),
        "m1_m": ([e.m1_m for e in errors], rms.m1_m),
        "position_m": ([e.position_m for e in errors], rms.position_m),
        "orientation_deg": ([math.degrees(e.orientation_rad) for e in errors], math.degrees(rms.orientation_rad)),
    }
    return {
        "samples": accumulator.samples,
        "judged": accumulator.judged,
        "valid_fraction": accumulator.valid_fraction,
        **{name: _statistics(values, whole) if values else None for name, (values, whole) in columns.items()},
    }


def _statistics(values: list[float], rms: float) -> dict[str, float]:
    x = np.array(values)
    q1, med, q3 = (float(q) for q in np.quantile(x, (0.25, 0.5, 0.75)))
    reach = 1.5 * (q3 - q1)
    return {
        "rms": rms,
        "sd": float(x.std()),
        "mean": float(x.mean()),
        "max": float(x.max()),
        "whislo": float(x[x >= q1 - reach].min()),
        "q1": q1,
        "med": med,
        "q3": q3,
        "whishi": float(x[x <= q3 + reach].max()),
    }
