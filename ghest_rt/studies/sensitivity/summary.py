"""What a sensitivity analysis comes to: tables, the paper's statements, and how close the surrogate is."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, cast

from ghest_rt.studies.numbers import finite
from ghest_rt.studies.paper_values import MEAN_RMSE_20_MM_DEG, PARAMETERS, STEP_M, STEPS
from ghest_rt.studies.sensitivity.checks import checks
from ghest_rt.studies.sensitivity.sobol import RANGES
from ghest_rt.studies.sensitivity.study import Row, SensitivityPlan

_COLUMNS = ("position_m_rms", "orientation_deg_rms", "S_position", "S_orientation", "valid_fraction")


def summarise(plan: SensitivityPlan, rows: Sequence[Row], indices: Sequence[Row], samples: int, cpu_s: float) -> dict[str, Any]:
    """Return the summary of an analysis as JSON takes it.

    `at_largest` has, by method, parameter and its largest amount, the mean over movements of errors and relative sensitivities;
    `mean_at_largest_shift` the mean over movements and q1 to q6 beside the paper's.

    Args:
        plan: What it comprises.
        rows: Its rows.
        indices: Its Sobol indices; may be empty.
        samples: Base samples of these.
        cpu_s: The processor time that it took.
    """
    methods = list(dict.fromkeys(cast(str, r["method"]) for r in rows))
    parameters = list(dict.fromkeys(cast(str, r["parameter"]) for r in rows))
    at_largest: list[Row] = []
    for method in methods:
        for parameter in parameters:
            several = [r for r in rows if (r["method"], r["parameter"]) == (method, parameter)]
            largest = max(cast(float, r["amount"]) for r in several)
            chosen = [r for r in several if r["amount"] == largest]
            head = {name: chosen[0][name] for name in ("group", "parameter", "what", "axis", "amount", "unit")}
            at_largest.append({"method": method, **head, **{column: _mean(chosen, column) for column in _COLUMNS}})
    shifted = {method: [r for r in at_largest if (r["method"], r["group"]) == (method, "shift")] for method in methods}
    return {
        "study": "sensitivity",
        "sensor": plan.sensor,
        "seed": plan.seed,
        "duration_s": plan.movements.duration_s,
        "cpu_s": cpu_s,
        "parameters": {name: {"marker": marker, "axis": axis} for name, (marker, axis) in PARAMETERS.items()},
        "paper": {"step_m": STEP_M, "steps": STEPS, "mean_orientation_deg_at_20_mm": MEAN_RMSE_20_MM_DEG},
        "undisturbed": [
            {"method": method, **{column: _mean(_undisturbed(rows, method), column) for column in _COLUMNS[:2]}}
            for method in methods
        ],
        "mean_at_largest_shift": [
            {
                "method": method,
                "amount_m": several[0]["amount"],
                "orientation_deg": _mean(several, "orientation_deg_rms"),
                "position_m": _mean(several, "position_m_rms"),
            }
            for method, several in shifted.items()
        ],
        "at_largest": at_largest,
        "checks": [asdict(check) for check in checks(rows)],
        "sobol": {"samples": samples, "ranges": RANGES, "indices": list(indices)},
        "rows": list(rows),
    }


def _undisturbed(rows: Sequence[Row], method: str) -> list[Row]:
    return [r for r in rows if (r["method"], r["group"], r["amount"]) == (method, "shift", 0.0)]


def _mean(rows: Sequence[Row], column: str) -> float | None:
    values = [cast(float, r[column]) for r in rows if r[column] is not None]
    return finite(sum(values) / len(values)) if values else None
