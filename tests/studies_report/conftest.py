"""A results folder as the studies leave it, with invented errors: nothing is rendered."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ghest_rt.studies.accuracy.summary import table
from ghest_rt.studies.compare.study import CompareSettings, compare
from ghest_rt.studies.engine.run import Job, Outcome
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.engine.task import Result
from ghest_rt.studies.figures.compare import figures as compare_figures
from ghest_rt.studies.figures.latency import figures as latency_figures
from ghest_rt.studies.figures.style import Drawn, new_figure
from ghest_rt.studies.latency.study import LatencySettings, latency
from ghest_rt.studies.latency.tasks import CANDIDATES
from ghest_rt.studies.movements import METHODS, Movements
from ghest_rt.studies.results import write_study
from ghest_rt.studies.rivals.angle_errors import ANGLE_QUANTITIES
from ghest_rt.studies.rivals.contenders import CONTENDERS
from ghest_rt.studies.session.errors import POSE_QUANTITIES


@dataclass(frozen=True)
class Invented:
    """Carries tasks out without doing them."""

    def run(self, jobs: Sequence[Job], store: ResultStore) -> Iterator[Outcome]:
        for job in jobs:
            store.save(job.key, Result(_values(job)), 0.0)
            yield Outcome(job)


def _values(job: Job) -> dict[str, object]:
    if job.task.kind.endswith("compare_session"):
        errors = {
            key: {
                **dict.fromkeys(ANGLE_QUANTITIES, 0.01 if key == "fused" else 0.5 + k),
                **{f"common_{name}": 0.5 + k for name in ANGLE_QUANTITIES},
                **{f"fused_common_{name}": 0.01 for name in ANGLE_QUANTITIES},
                "common_fraction": 1.0,
                "lag_ms": 45.0,
                "max_deg": 1.0,
                "samples": 100,
                "answered_fraction": 1.0,
                "angles_judged_fraction": 1.0,
            }
            for k, key in enumerate(CONTENDERS)
        }
        return {
            "duration_s": 1.0,
            "inertial_after_rest_deg": 8.5 if job.task.parameters["movement"] == "COMB" else 7.5,
            "girdle_turn_deg": 4.25,
            "hold_forecast_deg": 0.25,
            "straight_forecast_deg": 0.125,
            "contenders": errors,
        }
    if job.task.kind.endswith("judge_speed"):
        speed = np.linspace(0.0, 50.0, 60)
        return {
            key: {
                "lag_ms": 0.0,
                "own_instant_deg": 0.1,
                "age_ms": {"r0": 15.0, "r1": 14.0, "encoders": None},
                "speed_dps": speed.tolist(),
                "published_deg": (0.02 * speed + 0.01).tolist(),
            }
            for key in CANDIDATES
        }
    return {}


def accuracy_summary() -> dict[str, object]:
    rows: list[dict[str, Any]] = [
        {
            "sensor": "paper",
            "method": method,
            "quantity": quantity,
            "movement": m,
            "seed": seed,
            "rms": 0.001 + seed,
            "sd": 0.1,
            "valid_fraction": 0.875,
        }
        for method in METHODS
        for quantity in POSE_QUANTITIES
        for m in ("SAbAd", "SFE", "SIR", "COMB")
        for seed in (1, 2)
    ]
    check = {"name": "COMB is <worst>", "holds": False, "evidence": "none", "explanation": "invented"}
    return {"study": "accuracy", "seeds": [1, 2], "duration_s": None, "cpu_s": 1.0, "table": table(rows), "checks": [check]}


def sensitivity_summary() -> dict[str, object]:
    columns = {
        "position_m_rms": 0.02,
        "orientation_deg_rms": 3.456,
        "S_position": 0.98,
        "S_orientation": None,
        "valid_fraction": 1,
    }
    shift = {"group": "shift", "parameter": "q1", "what": "m0", "axis": "x", "amount": 0.02, "unit": "m"}
    turn = {"group": "turn", "parameter": "turn m0 x", "what": "m0", "axis": "x", "amount": 10.0, "unit": "deg"}
    return {
        "study": "sensitivity",
        "sensor": "paper",
        "duration_s": 1.5,
        "paper": {"mean_orientation_deg_at_20_mm": 3.6},
        "undisturbed": [{"method": m, "orientation_deg_rms": 0.1, "position_m_rms": 0.001} for m in METHODS],
        "mean_at_largest_shift": [{"method": m, "amount_m": 0.02, "orientation_deg": 2.5, "position_m": 0.01} for m in METHODS],
        "at_largest": [{"method": m, **of, **columns} for m in METHODS for of in (shift, turn)],
        "checks": [],
    }


def blank(*names: str) -> list[Drawn]:
    return [Drawn(name, f"caption of {name}", new_figure(1.0, 1.0), folded=name.endswith("fused")) for name in names]


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    store = ResultStore(folder / "tasks")
    some = Movements(("SFE", "COMB"))
    compared = compare(CompareSettings(movements=some), store, Invented())
    write_study(folder, compared, {"rows": compared["rows"]}, compare_figures(compared))
    late = latency(
        LatencySettings(movements=some, computing_frames=1), store, Invented(), clock=iter(range(0, 10**12, 10**6)).__next__
    )
    write_study(folder, late, {"rows": late["rows"]}, latency_figures(late))
    write_study(folder, accuracy_summary(), {}, blank("figure13_paper"))
    names = ("drift_by_method", "figure17_COMB_paper", "figure17_COMB_fused", "sobol_COMB", "further")
    write_study(folder, sensitivity_summary(), {}, blank(*names))
    return folder
