"""`study compare`: Table 7 made real. Every contender on the same sessions, beside what its own publication reports."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any, cast

from ghest_rt.studies.compare.verdicts import verdict
from ghest_rt.studies.engine.run import Executor, Progress, run_tasks
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.movements import METHODS, Movements, frames_of
from ghest_rt.studies.numbers import plain
from ghest_rt.studies.observing.scenario import Scenario, SensorName
from ghest_rt.studies.rivals.angle_errors import ANGLE_QUANTITIES
from ghest_rt.studies.rivals.contenders import CONTENDERS
from ghest_rt.studies.rivals.running import REST_S
from ghest_rt.studies.rivals.tasks import compare_task

Row = dict[str, object]


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareSettings:
    """What is compared on.

    Attributes:
        movements: What the patient does.
        sensors: Kinds of sensors.
        seeds: How many seeds, from 1 on.
    """

    movements: Movements
    sensors: tuple[SensorName, ...] = ("paper",)
    seeds: int = 1


QUICK = Movements(("COMB",), duration_s=1.5)
"""Enough to see that everything runs."""


def compare(
    settings: CompareSettings, store: ResultStore, executor: Executor, progress: Progress | None = None
) -> dict[str, Any]:
    """Run the comparison; return its summary, as JSON takes it.

    Returns:
        `settings`; `inertial_after_rest`, the inertial rival's error after the patient has held still, mean and range over all
        sessions; `rows`, one per sensor, movement, seed and contender; `contenders`, with their publications' figures and the
        means over movements; `verdicts`, one per sensor, movement and contender.

    Raises:
        BadInputError: A motion file cannot be read.
        GhestError: Tasks failed.
    """
    scenarios = [
        scenario
        for sensor in settings.sensors
        for seed in range(1, settings.seeds + 1)
        for scenario in settings.movements.scenarios(sensor, seed, METHODS)
    ]
    results = run_tasks([compare_task(s, frames_of(s)) for s in scenarios], store, executor, progress)
    rows = [row for scenario, result in zip(scenarios, results, strict=True) for row in _rows(scenario, result)]
    summary = {
        "study": "compare",
        "settings": {
            "movements": list(dict.fromkeys(scenario.name for scenario in scenarios)),
            "sensors": list(settings.sensors),
            "seeds": settings.seeds,
            "duration_s": settings.movements.duration_s,
        },
        "inertial_after_rest": _after_rest(results),
        "rows": rows,
        "contenders": [{**asdict(who), "measured": _means(rows, key)} for key, who in CONTENDERS.items()],
        "verdicts": _verdicts(rows),
    }
    return cast(dict[str, Any], plain(summary))


def _after_rest(results: Sequence[Mapping[str, object]]) -> Row:
    """Return what the inertial rival is off by after rest, over every session: first postures and sensors differ."""
    drift = [float(cast(float, result["inertial_after_rest_deg"])) for result in results]
    return {
        "rest_s": REST_S,
        "sessions": len(drift),
        "error_deg": fmean(drift),
        "least_deg": min(drift),
        "most_deg": max(drift),
    }


def _rows(scenario: Scenario, result: Mapping[str, object]) -> list[Row]:
    found = cast(Mapping[str, Mapping[str, float]], result["contenders"])
    return [
        {
            "sensor": scenario.sensor,
            "movement": scenario.name,
            "kind": "recorded" if scenario.motion is not None else "therapy",
            "seed": scenario.seed,
            "contender": key,
            **found[key],
            "duration_s": result["duration_s"],
            "girdle_turn_deg": result["girdle_turn_deg"],
            "hold_forecast_deg": result["hold_forecast_deg"],
            "straight_forecast_deg": result["straight_forecast_deg"],
        }
        for key in CONTENDERS
    ]


def _means(rows: Sequence[Row], key: str) -> list[Row]:
    """Return the means over movements and seeds, by sensor and kind of movement, as the paper's last column."""
    mine = [row for row in rows if row["contender"] == key]
    groups = dict.fromkeys((str(row["sensor"]), str(row["kind"])) for row in mine)
    return [
        {"sensor": sensor, "kind": kind, **_mean([row for row in mine if (row["sensor"], row["kind"]) == (sensor, kind)])}
        for sensor, kind in groups
    ]


def _mean(rows: Sequence[Row]) -> Row:
    return {name: mean_of(rows, name) for name in (*ANGLE_QUANTITIES, "answered_fraction")}


def mean_of(rows: Sequence[Mapping[str, object]], name: str) -> float:
    """Return the mean of a column over the rows that have it; NaN if none does."""
    values = [float(cast(float, row[name])) for row in rows if row[name] is not None]
    finite = [value for value in values if math.isfinite(value)]
    return fmean(finite) if finite else math.nan


def _verdicts(rows: Sequence[Row]) -> list[Row]:
    """Return for every sensor, movement and contender whether `fused` wins, by the means over seeds where both answer."""
    sessions = list(dict.fromkeys((str(row["sensor"]), str(row["movement"]), str(row["kind"])) for row in rows))
    verdicts: list[Row] = []
    for sensor, movement, kind in sessions:
        there = [row for row in rows if (row["sensor"], row["movement"]) == (sensor, movement)]
        simple_deg = min(mean_of(there, "hold_forecast_deg"), mean_of(there, "straight_forecast_deg"))
        of = {key: [row for row in there if row["contender"] == key] for key in CONTENDERS}
        fused_answers = mean_of(of["fused"], "answered_fraction")
        for key, who in CONTENDERS.items():
            if key != "fused":
                mine = of[key]
                theirs = {name: mean_of(mine, f"common_{name}") for name in ANGLE_QUANTITIES}
                fused = {name: mean_of(mine, f"fused_common_{name}") for name in ANGLE_QUANTITIES}
                said = verdict(
                    who,
                    {**theirs, "answered_fraction": mean_of(mine, "answered_fraction")},
                    {**fused, "answered_fraction": fused_answers},
                    float(cast(float, mine[0]["lag_ms"])),
                    simple_deg,
                )
                verdicts.append({"sensor": sensor, "movement": movement, "kind": kind, "contender": key, **asdict(said)})
    return verdicts
