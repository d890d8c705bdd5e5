"""`study compare` and `study latency` as a user runs them."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from ghest_rt.cli.main import app
from ghest_rt.errors import BadInputError
from ghest_rt.studies.accuracy import study as accuracy_study
from ghest_rt.studies.latency.tasks import judge_speed
from ghest_rt.studies.movements import Movements
from ghest_rt.studies.observing.scenario import Scenario, motion_file
from ghest_rt.studies.rivals.contenders import CONTENDERS
from ghest_rt.studies.rivals.tasks import answer_with_aruco
from ghest_rt.studies.sensitivity import sobol as sensitivity_sobol


def run(*words: str) -> dict[str, object]:
    result = CliRunner().invoke(app, ["study", *words, "--json"])
    assert result.exit_code == 0, result.output
    document: dict[str, object] = json.loads(result.stdout)
    return document


@pytest.mark.slow
def test_compare_puts_every_contender_on_the_same_session(tmp_path: Path) -> None:
    document = run("compare", "--quick", "--workers", "1", "--out", str(tmp_path))
    rows = {row["contender"]: row for row in document["rows"]}  # type: ignore[attr-defined]
    assert set(rows) == set(CONTENDERS)
    assert len({row["samples"] for row in rows.values()}) == 1
    assert all(row["answered_fraction"] > 0.9 for row in rows.values())
    for rival in ("exoskeleton", "coupled_chain", "swivel", "swivel_wrist", "aruco", "aruco_subpixel", "paper"):
        assert rows["fused"]["orientation_deg"] < rows[rival]["orientation_deg"]
    assert rows["aruco_subpixel"]["orientation_deg"] < rows["aruco"]["orientation_deg"]
    assert rows["fused"]["published_deg"] < rows["refined"]["published_deg"]
    verdicts = {v["contender"]: v for v in document["verdicts"]}  # type: ignore[attr-defined]
    assert set(verdicts) == set(CONTENDERS) - {"fused"}
    assert all(v["verdict"] for v in verdicts.values())
    rest = document["inertial_after_rest"]
    assert rest["error_deg"] > 10 * rows["fused"]["orientation_deg"]  # type: ignore[index]
    folder = tmp_path / "compare"
    assert json.loads((folder / "summary.json").read_text()) == document
    assert pq.read_table(folder / "rows.parquet").num_rows == len(CONTENDERS)
    for name in ("contenders_paper", "angles_paper"):
        assert all((folder / "figures" / f"{name}{ending}").stat().st_size > 1000 for ending in (".png", ".svg", ".pdf"))


@pytest.mark.slow
def test_latency_grows_with_speed_for_who_waits_and_hardly_for_who_forecasts(tmp_path: Path) -> None:
    document = run("latency", "--quick", "--workers", "1", "--out", str(tmp_path))
    who = {row["key"]: row for row in document["candidates"]}  # type: ignore[attr-defined]
    assert (who["refined"]["lag_ms"], who["fused"]["lag_ms"]) == (45.0, 0.0)
    assert who["refined"]["effective_delay_ms"] == pytest.approx(45.0, abs=6.0)
    assert who["paper_at_once"]["effective_delay_ms"] == pytest.approx(15.0, abs=5.0)  # a frame period
    assert who["fused"]["effective_delay_ms"] < 2.0
    rows = {(row["candidate"], row["speed"]): row for row in document["rows"]}  # type: ignore[attr-defined]
    assert rows["refined", 3.0]["published_deg"] > 2.0 * rows["refined", 1.0]["published_deg"]
    assert rows["fused", 3.0]["rms_speed_dps"] == pytest.approx(3.0 * rows["fused", 1.0]["rms_speed_dps"], rel=0.05)
    assert (tmp_path / "latency" / "figures" / "latency.svg").is_file()


def test_a_motion_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["study", "compare", "--motion", str(tmp_path / "no.mot"), "--out", str(tmp_path)])
    assert result.exit_code != 0
    assert "no.mot" in str(result.exception)


def test_a_motion_file_that_has_changed_is_refused_by_every_task(tmp_path: Path) -> None:
    path = tmp_path / "a.mot"
    path.write_text("x")
    scenario = Scenario(motion=motion_file(path))
    path.write_text("y")
    for task in (answer_with_aruco, judge_speed):
        parameters = scenario.model_dump(mode="json")
        if task is judge_speed:
            parameters = {"scenario": parameters, "factor": 1.0, "span_s": 1.0}
        with pytest.raises(BadInputError, match="has changed since the study began"):
            task(parameters, ())


def test_a_movement_named_twice_is_played_once(tmp_path: Path) -> None:
    path = tmp_path / "a.mot"
    path.write_text("x")
    (tmp_path / "sub").mkdir()
    twice = Movements(("SFE", "sfe", "COMB"), (path, tmp_path / "sub" / ".." / "a.mot"))
    assert [scenario.name for scenario in twice.scenarios("paper", 1, ("paper",))] == ["SFE", "COMB", "a"]


@pytest.mark.parametrize(
    ("name", "message"),
    [("a.mot", "the same name.*rename one"), ("Comb.mot", "movement of Table 2"), ("mean.mot", "another name")],
)
def test_movements_that_could_be_taken_for_one_another_are_refused(tmp_path: Path, name: str, message: str) -> None:
    (tmp_path / "sub").mkdir()
    files = tmp_path / "a.mot", tmp_path / "sub" / name
    for path in files:
        path.write_text("x")
    with pytest.raises(BadInputError, match=message):
        Movements(motions=files).scenarios("paper", 1, ("paper",))


def test_what_is_named_counts_in_a_quick_study_too(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Planned(Exception):
        """Ends a study once it is planned."""

    plans = []

    def keep(plan: object, *_: object) -> None:
        plans.append(plan)
        raise Planned

    monkeypatch.setattr(accuracy_study, "run_accuracy", keep)
    monkeypatch.setattr(sensitivity_sobol, "check_samples", keep)
    for words in (["accuracy"], ["accuracy", "--seeds", "5"], ["sensitivity"], ["sensitivity", "--sobol-samples", "64"]):
        CliRunner().invoke(app, ["study", *words, "--quick", "--out", str(tmp_path)])
    assert [getattr(plan, "seeds", plan) for plan in plans] == [(1, 2), (1, 2, 3, 4, 5), 16, 64]


def test_a_quick_study_is_of_what_was_named() -> None:
    small = Movements(("COMB",), duration_s=1.5)
    assert Movements().or_else(small) == small
    assert Movements(("SFE",)).or_else(small) == Movements(("SFE",), duration_s=1.5)
    assert Movements(motions=(Path("a.mot"),), duration_s=3.0).or_else(small) == Movements((), (Path("a.mot"),), 3.0)
