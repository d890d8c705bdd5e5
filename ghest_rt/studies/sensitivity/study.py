"""Plan and run the sensitivity analysis, Figure 11: every movement, parameter and amount; one tidy row each."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

from ghest_rt.studies.engine.run import Executor, Progress, run_tasks, spent_cpu_s
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.engine.task import Task
from ghest_rt.studies.movements import METHODS, Movements, frames_of
from ghest_rt.studies.numbers import finite
from ghest_rt.studies.observing.scenario import SensorName
from ghest_rt.studies.observing.tasks import observe_task
from ghest_rt.studies.paper_values import STEP_M, STEPS
from ghest_rt.studies.sensitivity.derivative import eq11_relative_sensitivity
from ghest_rt.studies.sensitivity.parameters import Group, Parameter, further_parameters, paper_parameters
from ghest_rt.studies.session.errors import POSE_QUANTITIES
from ghest_rt.studies.session.tasks import judge_task
from ghest_rt.vision.station import Method

Row = dict[str, object]

PAPER_SHIFTS_M = tuple(round(STEP_M * step, 6) for step in range(STEPS + 1))
"""Amounts of the paper's analysis, Table 4: 0 to 20 mm."""

QUICK_SHIFTS_M = (0.0, 0.004, 0.010, 0.020)
QUICK = Movements(duration_s=2.0)
"""Enough to see that everything runs."""

_FURTHER: dict[Group, tuple[float, ...]] = {
    "turn": (5.0, 10.0),
    "both": (0.010, 0.020),
    "mount_shift": (0.001, 0.002),
    "mount_turn": (0.5, 1.0),
    "encoder": (0.5, 1.0),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SensitivityPlan:
    """What a sensitivity analysis comprises.

    Attributes:
        movements: The movements.
        sensor: The cameras.
        seed: Of the simulation.
        methods: The methods judged.
        shifts_m: Amounts of q1 to q6, from 0 up.
        further: Whether to go beyond the paper's q1 to q6.
        every_amount: Whether further parameters get both of their amounts, or the larger only.
    """

    movements: Movements
    sensor: SensorName = "paper"
    seed: int = 1
    methods: tuple[Method, ...] = METHODS
    shifts_m: tuple[float, ...] = PAPER_SHIFTS_M
    further: bool = True
    every_amount: bool = True


@dataclass(frozen=True, slots=True)
class _Case:
    movement: str
    parameter: Parameter
    amount: float
    task: Task


def run_sensitivity(
    plan: SensitivityPlan, store: ResultStore, executor: Executor, progress: Progress | None = None
) -> tuple[list[Row], float]:
    """Run what is missing of an analysis; return its rows and the processor time spent on it, seconds.

    Returns:
        One row per movement, method, parameter and amount: `rms` and valid fraction, and the relative sensitivities of
        equation (11) where a parameter has three amounts or more.

    Raises:
        BadInputError: A movement or motion file cannot be used.
        GhestError: Tasks failed; the others are kept.
    """
    cases = _cases(plan)
    tasks = [case.task for case in cases]
    results = run_tasks(tasks, store, executor, progress)
    rows = [_row(plan, case, method, result) for case, result in zip(cases, results, strict=True) for method in plan.methods]
    _add_sensitivities(rows)
    return rows, spent_cpu_s(tasks, store)


def _cases(plan: SensitivityPlan) -> list[_Case]:
    cases = []
    for base in plan.movements.scenarios(plan.sensor, plan.seed, plan.methods):
        frames = frames_of(base)
        undisturbed = observe_task(base, frames)
        amounts: list[tuple[Parameter, Sequence[float]]] = [(parameter, plan.shifts_m) for parameter in paper_parameters()]
        if plan.further:
            for parameter in further_parameters():
                given = _FURTHER[parameter.group]
                amounts.append((parameter, (0.0, *given) if plan.every_amount else (0.0, given[-1])))
        cases += [
            _Case(base.name, parameter, amount, judge_task(parameter.applied(base, amount), frames, undisturbed))
            for parameter, several in amounts
            for amount in several
        ]
    return cases


def _row(plan: SensitivityPlan, case: _Case, method: Method, result: dict[str, object]) -> Row:
    found = cast(dict[str, Any], result[method])
    return {
        "sensor": plan.sensor,
        "movement": case.movement,
        "method": method,
        "group": case.parameter.group,
        "parameter": case.parameter.name,
        "what": case.parameter.what,
        "axis": case.parameter.axis,
        "amount": case.amount,
        "unit": case.parameter.unit,
        **{f"{name}_rms": None if found[name] is None else found[name]["rms"] for name in POSE_QUANTITIES},
        "samples": found["samples"],
        "valid_fraction": found["valid_fraction"],
        "S_position": None,
        "S_orientation": None,
    }


def _add_sensitivities(rows: Sequence[Row]) -> None:
    """Fill in equation (11), parameter by parameter."""
    curves: dict[tuple[object, ...], list[Row]] = {}
    for row in rows:
        curves.setdefault((row["movement"], row["method"], row["parameter"]), []).append(row)
    for curve in curves.values():
        if len(curve) < 3:
            continue
        q = [cast(float, row["amount"]) for row in curve]
        for column, quantity in (("S_position", "position_m"), ("S_orientation", "orientation_deg")):
            F = [cast(float, row[f"{quantity}_rms"]) for row in curve]
            if None not in F:
                for row, S in zip(curve, eq11_relative_sensitivity(q, F).tolist(), strict=True):
                    row[column] = finite(S)
