"""Global sensitivity: Sobol indices of the arm's errors when everything is wrong at once, on the surrogate.

First-order index: the share of the error's variance that one parameter explains alone; total index: alone and together with
others (Saltelli's sampling and estimators, library SALib).
"""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import Array
from ghest_rt.studies.engine.run import Executor, Progress, run_tasks
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.engine.task import Result, Task
from ghest_rt.studies.movements import frames_of
from ghest_rt.studies.numbers import finite
from ghest_rt.studies.observing.packing import unpack
from ghest_rt.studies.observing.scenario import Scenario
from ghest_rt.studies.observing.tasks import observe_task
from ghest_rt.studies.sensitivity.parameters import Group, Parameter, further_parameters, paper_parameters
from ghest_rt.studies.sensitivity.surrogate import Surrogate

RANGES: dict[Group, float] = {"shift": 0.020, "turn": 5.0, "mount_shift": 0.001, "mount_turn": 0.5, "encoder": 0.5}
"""Each parameter is uniform within plus and minus this: metres or degrees."""

_CHUNK = 256
_INSTANTS = 16
_OUTPUTS = ("position_m", "orientation_deg")


def sobol_parameters() -> list[Parameter]:
    """Return the parameters that vary."""
    return [p for p in (*paper_parameters(), *further_parameters()) if p.group in RANGES]


def check_samples(samples: int) -> None:
    """Refuse a number of base samples that Saltelli's sampling cannot use.

    Raises:
        BadInputError: It is not a power of two.
    """
    if samples < 1 or samples & (samples - 1):
        raise BadInputError(f"--sobol-samples {samples}: give a power of two, such as 256")


def run_sobol(
    scenarios: Sequence[Scenario],
    samples: int,
    store: ResultStore,
    executor: Executor,
    progress: Progress | None = None,
) -> list[dict[str, object]]:
    """Return the Sobol indices of every movement.

    Args:
        scenarios: The undisturbed sessions.
        samples: Base samples N, a power of two; the surrogate is run N (parameters + 2) times a movement.
        store: Where results are kept.
        executor: What carries the tasks out.
        progress: Told (cost done, cost of all).

    Returns:
        One row per movement, output and parameter: `S1` and `ST` with the half widths of their 95 % confidence intervals; None
        where the error does not vary at all.
    """
    runs = samples * (len(sobol_parameters()) + 2)
    tasks = [
        [
            Task.of(
                "ghest_rt.studies.sensitivity.sobol:evaluate",
                {"samples": samples, "seed": scenario.seed, "first": first},
                needs=(observe_task(scenario, frames_of(scenario)),),
                cost=0.4 * min(_CHUNK, runs - first),
            )
            for first in range(0, runs, _CHUNK)
        ]
        for scenario in scenarios
    ]
    results = iter(run_tasks([task for chunk in tasks for task in chunk], store, executor, progress))
    rows: list[dict[str, object]] = []
    for scenario, chunk in zip(scenarios, tasks, strict=True):
        values = [cast(dict[str, Any], next(results)) for _ in chunk]
        for output in _OUTPUTS:
            F = np.concatenate([value[output] for value in values])
            rows += [{"movement": scenario.name, "output": output, **row} for row in _indices(F, scenario.seed)]
    return rows


def evaluate(parameters: dict[str, object], needs: Sequence[Result]) -> Result:
    """Carry out one chunk: the surrogate's errors at some of Saltelli's samples."""
    given = cast(dict[str, int], parameters)
    several = sobol_parameters()
    samples = _samples(given["samples"], given["seed"])[given["first"] : given["first"] + _CHUNK]
    surrogate = Surrogate(unpack(needs[0]), _INSTANTS)
    errors = [surrogate.errors(dict(zip(several, row.tolist(), strict=True))) for row in samples]
    return Result({name: [error[k] for error in errors] for k, name in enumerate(_OUTPUTS)})


def _problem() -> dict[str, Any]:
    several = sobol_parameters()
    bounds = [[-RANGES[p.group], RANGES[p.group]] for p in several]
    return {"num_vars": len(several), "names": [p.name for p in several], "bounds": bounds}


def _samples(samples: int, seed: int) -> Array:
    from SALib.sample import sobol  # noqa: PLC0415 - an extra, imported only when used

    return np.asarray(sobol.sample(_problem(), samples, calc_second_order=False, seed=seed))


def _indices(F: Array, seed: int) -> list[dict[str, object]]:
    from SALib.analyze import sobol  # noqa: PLC0415 - an extra, imported only when used

    found = sobol.analyze(_problem(), F, calc_second_order=False, seed=seed)
    columns = ("S1", "S1_conf", "ST", "ST_conf")
    return [
        {"parameter": p.name, "group": p.group, "what": p.what, "axis": p.axis, **{c: finite(found[c][k]) for c in columns}}
        for k, p in enumerate(sobol_parameters())
    ]
