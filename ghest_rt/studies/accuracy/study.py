"""Run every movement with several seeds; one tidy row per movement, sensor, method, seed and quantity."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

from ghest_rt.studies.engine.run import Executor, Progress, run_tasks, spent_cpu_s
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.movements import METHODS, Movements, frames_of
from ghest_rt.studies.observing.scenario import Scenario, SensorName
from ghest_rt.studies.session.errors import POSE_QUANTITIES, STATISTICS
from ghest_rt.studies.session.tasks import judge_task
from ghest_rt.vision.station import Method

Row = dict[str, object]


QUICK = Movements(duration_s=2.0)
"""Enough to see that everything runs."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AccuracyPlan:
    """What an accuracy study comprises.

    Attributes:
        movements: The movements.
        sensors: The kinds of cameras.
        methods: The methods judged.
        seeds: Seeds of the simulation: movement's phases and tempo, encoders' timing, sensor noise.
    """

    movements: Movements
    sensors: tuple[SensorName, ...] = ("paper", "sr300")
    methods: tuple[Method, ...] = METHODS
    seeds: tuple[int, ...] = (1, 2, 3)


def run_accuracy(
    plan: AccuracyPlan, store: ResultStore, executor: Executor, progress: Progress | None = None
) -> tuple[list[Row], float]:
    """Run what is missing of a study; return its rows and the processor time spent on it, seconds.

    Raises:
        BadInputError: A movement or motion file cannot be used.
        GhestError: Tasks failed; the others are kept.
    """
    scenarios = [
        scenario
        for sensor in plan.sensors
        for seed in plan.seeds
        for scenario in plan.movements.scenarios(sensor, seed, plan.methods)
    ]
    tasks = [judge_task(scenario, frames_of(scenario)) for scenario in scenarios]
    results = run_tasks(tasks, store, executor, progress)
    rows: list[Row] = []
    for scenario, result in zip(scenarios, results, strict=True):
        for method in plan.methods:
            rows += _rows(scenario, method, cast(dict[str, Any], result[method]))
    return rows, spent_cpu_s(tasks, store)


def _rows(scenario: Scenario, method: Method, found: dict[str, Any]) -> list[Row]:
    return [
        {
            "sensor": scenario.sensor,
            "method": method,
            "movement": scenario.name,
            "seed": scenario.seed,
            "quantity": quantity,
            **(found[quantity] or dict.fromkeys(STATISTICS)),
            "samples": found["samples"],
            "judged": found["judged"],
            "valid_fraction": found["valid_fraction"],
        }
        for quantity in POSE_QUANTITIES
    ]


def select(rows: Sequence[Row], **wanted: object) -> list[Row]:
    """Return the rows with these values."""
    return [row for row in rows if all(row[name] == value for name, value in wanted.items())]
