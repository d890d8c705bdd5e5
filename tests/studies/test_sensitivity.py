"""The sensitivity analysis: equation (11), what perturbations do, the paper's statements."""

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from ghest_rt.errors import BadInputError
from ghest_rt.studies.engine.local import LocalExecutor
from ghest_rt.studies.engine.run import run_tasks
from ghest_rt.studies.engine.store import ResultStore
from ghest_rt.studies.movements import Movements
from ghest_rt.studies.observing.observed import observe
from ghest_rt.studies.observing.scenario import MountError, Scenario
from ghest_rt.studies.paper_values import MOVEMENTS, PARAMETERS
from ghest_rt.studies.sensitivity.checks import checks
from ghest_rt.studies.sensitivity.derivative import eq11_relative_sensitivity
from ghest_rt.studies.sensitivity.parameters import Parameter, further_parameters, paper_parameters
from ghest_rt.studies.sensitivity.sobol import check_samples, run_sobol, sobol_parameters
from ghest_rt.studies.sensitivity.study import Row, SensitivityPlan, run_sensitivity
from ghest_rt.studies.sensitivity.summary import summarise
from ghest_rt.studies.sensitivity.surrogate import Surrogate
from ghest_rt.studies.session.tasks import judge_task


@pytest.mark.parametrize("b", [0.0, 2e-4])
def test_equation_11_is_exact_where_errors_add_in_quadrature_on_even_and_uneven_amounts(b: float) -> None:
    for q in (np.linspace(0.0, 0.020, 11), np.array([0.0, 0.004, 0.010, 0.020])):
        squared = 1e-6 + b * q + 0.25 * q**2
        exact = q * (b + 0.5 * q) / (2 * squared)
        np.testing.assert_allclose(eq11_relative_sensitivity(q, np.sqrt(squared)), exact, rtol=1e-9, atol=1e-12)


def test_the_limit_at_no_translation_is_none_unless_the_estimate_is_perfect() -> None:
    q = np.linspace(0.0, 0.020, 11)
    assert eq11_relative_sensitivity(q, np.sqrt(1e-6 + q**2))[0] == 0.0
    np.testing.assert_allclose(eq11_relative_sensitivity(q, 0.5 * q), 1.0)


def test_perturbations_are_tables_3_and_change_nothing_else() -> None:
    base = Scenario(movement="COMB")
    assert [p.name for p in paper_parameters()] == list(PARAMETERS)
    assert Parameter("shift", "m1", "z").applied(base, 0.02).shifts == ("m1:z:0.02",)
    assert Parameter("shift", "m1", "z").applied(base, 0.0) == base
    assert Parameter("both", "m0+m1", "x").applied(base, 0.01).moved_markers == {"m0", "m1"}
    assert Parameter("turn", "m0", "y").applied(base, 5.0).turns == ("m0:y:5",)
    turned = Parameter("mount_turn", "r1", "z").applied(base, 1.0).mount_errors["r1"]
    assert turned.rotation_rad == (0.0, 0.0, pytest.approx(math.radians(1.0)))
    assert Parameter("encoder", "j2", "").applied(base, 1.0).encoder_bias_rad == {"j2": pytest.approx(math.radians(1.0))}
    names = [p.name for p in (*paper_parameters(), *further_parameters())]
    assert len(names) == len(set(names))


PLAN = SensitivityPlan(
    movements=Movements(("SIR",), duration_s=0.4), methods=("paper", "refined"), shifts_m=(0.0, 0.01, 0.02), every_amount=False
)


@pytest.fixture(scope="module")
def analysis(tmp_path_factory: pytest.TempPathFactory) -> list[Row]:
    rows, cpu_s = run_sensitivity(PLAN, ResultStore(tmp_path_factory.mktemp("study")), LocalExecutor(1))
    assert cpu_s > 0.0
    return rows


def rms(rows: list[Row], method: str, parameter: str, amount: float, quantity: str) -> float:
    wanted = (method, parameter, amount)
    return next(cast(float, r[f"{quantity}_rms"]) for r in rows if (r["method"], r["parameter"], r["amount"]) == wanted)


def test_a_marker_displaced_moves_the_middle_of_the_arm_by_half_of_it_and_turns_it_if_across(analysis: list[Row]) -> None:
    for parameter in PARAMETERS:
        assert rms(analysis, "refined", parameter, 0.02, "position_m") == pytest.approx(0.010, rel=0.05)
        assert rms(analysis, "paper", parameter, 0.02, "position_m") == pytest.approx(0.010, rel=0.2)
    across = math.degrees(0.02 / 0.3255)
    assert rms(analysis, "refined", "q4", 0.02, "orientation_deg") == pytest.approx(across, rel=0.05)
    assert rms(analysis, "refined", "q6", 0.02, "orientation_deg") == pytest.approx(across, rel=0.05)
    assert rms(analysis, "refined", "q5", 0.02, "orientation_deg") < 0.05 * across


def test_relative_sensitivities_are_there_where_there_are_amounts_enough(analysis: list[Row]) -> None:
    for row in analysis:
        if row["group"] == "shift":
            S = cast(float, row["S_position"])
            assert (S == 0.0) if row["amount"] == 0.0 else (0.5 < S < 1.5)
        else:
            assert row["S_position"] is None


def test_the_surrogate_stands_for_the_rendered_pipeline(analysis: list[Row]) -> None:
    surrogate = Surrogate(observe(Scenario(movement="SIR", duration_s=0.4).world(), (), ()), 8)
    assert surrogate.errors({}) == (pytest.approx(0.0, abs=1e-9), pytest.approx(0.0, abs=1e-6))
    compared = [r for r in analysis if r["method"] == "refined" and r["amount"] and r["group"] != "both"]
    assert {r["group"] for r in compared} == {"shift", "turn", "mount_shift", "mount_turn", "encoder"}
    for row in compared:
        parameter = Parameter(cast(Any, row["group"]), cast(str, row["what"]), cast(str, row["axis"]))
        position_m, orientation_deg = surrogate.errors({parameter: cast(float, row["amount"])})
        assert position_m == pytest.approx(cast(float, row["position_m_rms"]), rel=0.05, abs=5e-5)
        assert orientation_deg == pytest.approx(cast(float, row["orientation_deg_rms"]), rel=0.05, abs=0.03)


def test_several_things_wrong_at_once_are_composed_as_in_the_scene(tmp_path: Path) -> None:
    amounts = {
        Parameter("shift", "m0", "y"): 0.012,
        Parameter("shift", "m1", "x"): -0.01,
        **{Parameter("turn", "m1", axis): 15.0 for axis in ("x", "y", "z")},
        **{Parameter("turn", "m0", axis): -10.0 for axis in ("x", "z")},
        **{Parameter("mount_turn", "r1", axis): 3.0 for axis in ("x", "y", "z")},
        Parameter("encoder", "j2", ""): 1.0,
    }
    degrees = math.radians(3.0)
    base = Scenario(movement="SIR", duration_s=0.2, methods=("refined",))
    case = base.model_copy(
        update={
            "shifts": ("m0:y:0.012", "m1:x:-0.01"),
            "turns": ("m1:x:15", "m1:y:15", "m1:z:15", "m0:x:-10", "m0:z:-10"),
            "mount_errors": {"r1": MountError(rotation_rad=(degrees, degrees, degrees))},
            "encoder_bias_rad": {"j2": math.radians(1.0)},
        }
    )
    found = cast(Any, run_tasks([judge_task(case, 13)], ResultStore(tmp_path), LocalExecutor(1)))[0]["refined"]
    position_m, orientation_deg = Surrogate(observe(base.world(), (), ()), 8).errors(amounts)
    assert position_m == pytest.approx(found["position_m"]["rms"], rel=0.01)
    assert orientation_deg == pytest.approx(found["orientation_deg"]["rms"], rel=0.01)


def test_sobol_indices_know_what_matters(tmp_path: Path) -> None:
    rows = run_sobol([Scenario(movement="SIR", duration_s=0.1)], 8, ResultStore(tmp_path), LocalExecutor(1))
    assert len(rows) == 2 * len(sobol_parameters())
    total = {(r["output"], r["parameter"]): cast(float, r["ST"]) for r in rows}
    # 20 mm along the arm's x weigh on its direction; a bias of the encoder of the wrist's side of the elbow weighs less.
    assert total["orientation_deg", "q4"] > total["orientation_deg", "encoder j6"]
    assert all(value > -0.05 for value in total.values())
    with pytest.raises(BadInputError, match="power of two"):
        check_samples(100)


def test_the_summary_tells_means_over_movements_and_judges_only_all_of_the_papers_movements(analysis: list[Row]) -> None:
    summary = summarise(PLAN, analysis, [], 16, 1.0)
    assert summary["checks"] == []
    at = {(r["method"], r["parameter"]): r for r in summary["at_largest"]}
    assert at["refined", "q4"]["orientation_deg_rms"] == rms(analysis, "refined", "q4", 0.02, "orientation_deg")
    assert {r["method"] for r in summary["mean_at_largest_shift"]} == {"paper", "refined"}


def made_up(
    shift_deg: dict[str, float], *, start_m: float = 1e-3, m0_scale: float = 1.1, method: str = "paper", sensor: str = "paper"
) -> list[Row]:
    """Rows of an analysis in which errors add in quadrature."""
    rows: list[Row] = []
    for movement in MOVEMENTS:
        for name, (marker, axis) in PARAMETERS.items():
            q = np.array([0.0, 0.01, 0.02])
            position = np.sqrt(start_m**2 + (0.5 * q * (m0_scale if marker == "m0" else 1.0)) ** 2)
            orientation = np.sqrt(1.0 + (shift_deg[name] * q / 0.02) ** 2)
            S = eq11_relative_sensitivity(q, position), eq11_relative_sensitivity(q, orientation)
            rows += [
                {
                    "sensor": sensor,
                    "movement": movement,
                    "method": method,
                    "group": "shift",
                    "parameter": name,
                    "what": marker,
                    "axis": axis,
                    "amount": amount,
                    "position_m_rms": position[k],
                    "orientation_deg_rms": orientation[k],
                    "S_position": S[0][k],
                    "S_orientation": S[1][k],
                }
                for k, amount in enumerate(q.tolist())
            ]
    return rows


def test_every_statement_of_the_paper_can_hold_and_can_fail() -> None:
    like_the_paper = {"q1": 3.0, "q2": 3.0, "q3": 2.0, "q4": 3.5, "q5": 0.2, "q6": 3.5}
    good = checks(made_up(like_the_paper))
    assert [check.holds for check in good] == [True] * 6
    assert all(check.evidence and check.explanation for check in good)
    turned_round = {"q1": 6.0, "q2": 6.0, "q3": 6.0, "q4": 5.0, "q5": 5.5, "q6": 5.0}
    bad = checks(made_up(turned_round, start_m=1.0, m0_scale=0.9))
    assert [check.holds for check in bad] == [False] * 6


def test_the_papers_statements_are_of_its_own_sensor_and_movements() -> None:
    rows = made_up(dict.fromkeys(PARAMETERS, 3.0))
    assert checks(made_up(dict.fromkeys(PARAMETERS, 3.0), sensor="sr300")) == []
    assert checks([row for row in rows if row["movement"] != "SIR"]) == []
    assert len(checks(rows)) == 6


def test_a_statement_about_a_marker_that_was_never_seen_does_not_hold_and_says_so() -> None:
    rows = made_up({"q1": 3.0, "q2": 3.0, "q3": 2.0, "q4": 3.5, "q5": 0.2, "q6": 3.5})
    for row in rows:
        if (row["movement"], row["parameter"], row["amount"]) == ("SFE", "q5", 0.02):
            row |= {"position_m_rms": None, "orientation_deg_rms": None, "S_position": None, "S_orientation": None}
    found = checks(rows)
    assert [check.holds for check in found] == [False, False, False, True, False, False]
    assert "at 20 mm nothing is known of SFE q5" in found[0].evidence


def test_refined_is_named_only_where_it_was_run() -> None:
    shift_deg = {"q1": 3.0, "q2": 3.0, "q3": 2.0, "q4": 3.5, "q5": 0.2, "q6": 3.5}
    alone, beside = made_up(shift_deg), [*made_up(shift_deg), *made_up(shift_deg, method="refined")]
    assert not any("refined" in check.evidence + check.explanation for check in checks(alone))
    assert "By method refined SAbAd" in checks(beside)[1].evidence
    assert "Method refined, which hardly has one, shows it" in checks(beside)[1].explanation


def test_on_rendered_sessions_the_papers_method_bears_out_what_geometry_says_of_it(tmp_path: Path) -> None:
    plan = SensitivityPlan(movements=Movements(duration_s=0.2), methods=("paper",), shifts_m=(0.0, 0.01, 0.02), further=False)
    rows, _ = run_sensitivity(plan, ResultStore(tmp_path), LocalExecutor(1))
    found = {check.name: check for check in checks(rows)}
    holds = {name.partition(" (")[0]: check.holds for name, check in found.items()}
    assert len(holds) == 6
    assert holds["The relative sensitivity of the position tends to 1"]
    assert holds["Of m1's translations, those along the arm"]
    assert holds["With marker drifts of 20 mm the orientation error is 3.6° or less"]
    assert not any("nothing is known" in check.evidence for check in found.values())
