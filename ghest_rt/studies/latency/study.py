"""`study latency`: how far published angles are behind the arm, by how fast it moves."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, cast

import numpy as np

from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import Array
from ghest_rt.studies.engine.run import Executor, Progress, run_tasks
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.latency.computing import Clock, measure_computing
from ghest_rt.studies.latency.tasks import CANDIDATES, latency_task
from ghest_rt.studies.movements import METHODS, Movements
from ghest_rt.studies.numbers import plain
from ghest_rt.studies.observing.scenario import SensorName

BIN_EDGES_DPS = (0.0, 5.0, 10.0, 20.0, 40.0, 60.0, 80.0, 120.0, 160.0, 240.0)
"""Bins of the GH joint's angular speed; the last one is open."""

TITLES = {
    "paper": "paper, with the station's lag",
    "paper_at_once": "paper, latest frames",
    "refined": "refined",
    "fused": "fused",
}
SPEEDS = (0.5, 1.0, 2.0, 3.0)
"""How fast movements are played, as factors."""

COMPUTING_FRAMES = 25
_SPAN_S = 8.0
_LEAST_IN_BIN = 10
_COMPUTING_S = 0.6

Row = dict[str, object]


@dataclass(frozen=True, slots=True, kw_only=True)
class LatencySettings:
    """What is played.

    Attributes:
        movements: What the patient does; `duration_s` is how much of each is played, in its own time, 8 s by default.
        speeds: Factors on the speed.
        sensor: Kind of sensors.
        seed: Of the simulation.
        computing_frames: How many frames the computing time is measured on.
    """

    movements: Movements
    speeds: tuple[float, ...] = SPEEDS
    sensor: SensorName = "paper"
    seed: int = 1
    computing_frames: int = COMPUTING_FRAMES


QUICK = Movements(("COMB",), duration_s=1.2)
"""Enough to see that everything runs."""

QUICK_SPEEDS = (1.0, 3.0)
QUICK_COMPUTING_FRAMES = 10


def latency(
    settings: LatencySettings,
    store: ResultStore,
    executor: Executor,
    progress: Progress | None = None,
    clock: Clock = time.perf_counter_ns,
) -> dict[str, Any]:
    """Run the study; return its summary, as JSON takes it.

    Every sample is judged by the truth at the instant at which it is published, `lag_ms` after the instant it holds for.

    Returns:
        `settings`; `rows`, one per movement, speed and candidate: RMS error when published and at its own instant, RMS speed of
        the GH joint; `bins`, the published error by angular speed over everything played; `candidates`: lag, ages of the
        inputs, `effective_delay_ms`, the slope of error against speed, and `vision_ms` and `answer_ms`, how long this machine
        takes to find a marker and to answer.

    Raises:
        BadInputError: A movement cannot be used, or so little is played that no speed is judged.
        GhestError: Tasks failed.
    """
    scenarios = settings.movements.scenarios(settings.sensor, settings.seed, METHODS)
    span_s = settings.movements.duration_s or _SPAN_S
    cases = [(scenario, speed) for scenario in scenarios for speed in settings.speeds]
    tasks = [latency_task(scenario.undisturbed().model_copy(update={"duration_s": None}), s, span_s) for scenario, s in cases]
    results = run_tasks(tasks, store, executor, progress)
    found = [cast(Mapping[str, Row], result) for result in results]
    rows = [
        {"movement": scenario.name, "speed": speed, "candidate": key, **_row(result[key])}
        for (scenario, speed), result in zip(cases, found, strict=True)
        for key in CANDIDATES
    ]
    pooled = {key: _pooled([result[key] for result in found]) for key in CANDIDATES}
    bins = [row for key, (speeds, errors) in pooled.items() for row in _bins(key, speeds, errors)]
    if not bins:
        raise BadInputError(f"--duration {span_s:g}: no speed comes to {_LEAST_IN_BIN} samples; give more seconds")
    clinic = scenarios[0].undisturbed().model_copy(update={"duration_s": _COMPUTING_S}).world()
    computing = {
        method: measure_computing(clinic, method, settings.computing_frames, clock)
        for method in dict.fromkeys(method for method, _ in CANDIDATES.values())
    }
    summary = {
        "study": "latency",
        "settings": {
            "movements": [scenario.name for scenario in scenarios],
            "speeds": list(settings.speeds),
            "sensor": settings.sensor,
            "seed": settings.seed,
            "span_s": span_s,
        },
        "rows": rows,
        "bins": bins,
        "candidates": [
            {
                "key": key,
                "title": TITLES[key],
                "lag_ms": found[0][key]["lag_ms"],
                "age_ms": found[0][key]["age_ms"],
                "effective_delay_ms": effective_delay_ms(*pooled[key]),
                "published_deg": _rms(pooled[key][1]),
                **asdict(computing[method]),
            }
            for key, (method, _) in CANDIDATES.items()
        ],
    }
    return cast(dict[str, Any], plain(summary))


def effective_delay_ms(speed_dps: Array, error_deg: Array) -> float:
    """Return the slope of error against speed, least squares through the origin: how long the answer is behind the arm.

    Args:
        speed_dps: (n,) angular speeds.
        error_deg: (n,) errors.
    """
    power = float(speed_dps @ speed_dps)
    return 1000.0 * float(speed_dps @ error_deg) / power if power > 0.0 else math.nan


def _row(result: Row) -> Row:
    speeds, errors = _pooled([result])
    return {
        "lag_ms": result["lag_ms"],
        "published_deg": _rms(errors),
        "own_instant_deg": result["own_instant_deg"],
        "rms_speed_dps": _rms(speeds),
        "samples": int(errors.size),
    }


def _pooled(results: Sequence[Row]) -> tuple[Array, Array]:
    speeds = np.concatenate([np.array(result["speed_dps"], dtype=np.float64) for result in results])
    errors = np.concatenate([np.array(result["published_deg"], dtype=np.float64) for result in results])
    return speeds, errors


def _bins(key: str, speeds: Array, errors: Array) -> list[Row]:
    """Return error statistics by bins of speed; bins with few samples are left out."""
    rows: list[Row] = []
    for low, high in zip(BIN_EDGES_DPS, (*BIN_EDGES_DPS[1:], math.inf), strict=True):
        inside = (speeds >= low) & (speeds < high)
        if int(inside.sum()) >= _LEAST_IN_BIN:
            q05, q50, q95 = np.quantile(errors[inside], (0.05, 0.5, 0.95))
            rows.append(
                {
                    "candidate": key,
                    "from_dps": low,
                    "to_dps": None if math.isinf(high) else high,
                    "mean_speed_dps": float(speeds[inside].mean()),
                    "samples": int(inside.sum()),
                    "rms_deg": _rms(errors[inside]),
                    "q05_deg": float(q05),
                    "median_deg": float(q50),
                    "q95_deg": float(q95),
                }
            )
    return rows


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else math.nan
