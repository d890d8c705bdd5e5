"""The estimators' share of a tick, vision left out: encoder row, a sighting of each marker, estimate; CPU time of one core."""

import time
from pathlib import Path
from typing import Any

from benchmarks.observed import Session, estimates, observed
from benchmarks.timing import summary_ms
from ghest_rt.estimation.factory import make_estimator
from ghest_rt.estimation.interface import GhEstimator
from ghest_rt.estimation.pipeline import lag_ns_of
from ghest_rt.simulation.options import SimulateOptions

_WARM_UP = 60


def run(quick: bool) -> dict[str, Any]:
    """Time `fused` and, side by side in the same run, the estimator of `refined`."""
    options = SimulateOptions(out=Path(), movement="COMB", sensor="paper", seed=1, duration_s=4.0 if quick else 10.0)
    session = observed(options, "refined")
    spent: dict[str, list[float]] = {"refined": [], "fused": []}
    for _ in range(1 if quick else 3):
        for method, seconds in spent.items():
            seconds.extend(_ticks(session, method))
    result: dict[str, Any] = {f"{method} tick": summary_ms(seconds) for method, seconds in spent.items()}
    medians = [result[f"{method} tick"]["median_ms"] for method in ("fused", "refined")]
    result["fused per refined"] = round(medians[0] / medians[1], 2)
    return result


def _ticks(session: Session, method: str) -> list[float]:
    seconds: list[float] = []
    last = time.thread_time()

    def tick() -> None:
        nonlocal last
        seconds.append(time.thread_time() - last)
        last = time.thread_time()

    estimates(session, estimator_for(session, method), lag_ns_of(session.station.config, method), tick)
    return seconds[_WARM_UP:]


def estimator_for(session: Session, method: str) -> GhEstimator:
    """Return a new estimator for a session."""
    return make_estimator(
        session.station.config,
        session.station.urdf_text,
        session.station.source,
        session.joints,
        method="fused" if method == "fused" else "refined",
        frame_rate_hz={camera: info.rate_hz for camera, info in session.infos.items()},
    )
