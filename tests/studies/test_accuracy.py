"""The accuracy study, from the command line to tables and figures."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from pyarrow import parquet
from typer.testing import CliRunner

from ghest_rt.cli.main import app
from ghest_rt.errors import BadInputError
from ghest_rt.studies.accuracy.summary import checks, confidence_interval, table
from ghest_rt.studies.figures.accuracy import draw_figure_13
from ghest_rt.studies.paper_values import ACCURACY, MEAN, MOVEMENTS
from ghest_rt.studies.session.errors import POSE_QUANTITIES

BOX = {"whislo": 0.5e-3, "q1": 0.8e-3, "med": 1e-3, "q3": 1.2e-3, "whishi": 2e-3}


def made_up(rms: dict[tuple[str, str], float], seeds: int = 2) -> list[dict[str, Any]]:
    return [
        {
            "sensor": "paper",
            "method": "paper",
            "movement": movement,
            "seed": seed,
            "quantity": quantity,
            "rms": rms[quantity, movement] * (1.0 + 0.01 * seed),
            "sd": 1e-4,
            "valid_fraction": 0.75,
            **BOX,
        }
        for seed in range(seeds)
        for movement in MOVEMENTS
        for quantity in POSE_QUANTITIES
    ]


def papers() -> dict[tuple[str, str], float]:
    return {(q, m): of.rms for q, movements in ACCURACY.items() for m, of in movements.items()}


def test_the_papers_tables_agree_with_the_means_in_its_text() -> None:
    for quantity, of in ACCURACY.items():
        assert sum(of[m].rms for m in MOVEMENTS) / 4 == pytest.approx(MEAN[quantity], rel=0.007)


def test_the_table_has_means_over_seeds_with_intervals_and_the_papers_beside() -> None:
    entries = {(e["quantity"], e["movement"]): e for e in table(made_up(papers()))}
    comb = entries["orientation_deg", "COMB"]
    assert comb["rms"] == pytest.approx(1.0638 * 1.005)
    assert comb["rms_low"] < comb["rms"] < comb["rms_high"]
    assert (comb["paper_rms"], comb["paper_sd"], comb["seeds"]) == (1.0638, 0.5238, 2)
    mean = entries["orientation_deg", "mean"]
    assert mean["paper_rms"] == 0.88921
    assert comb["valid_fraction"] == mean["valid_fraction"] == 0.75
    assert mean["rms"] == pytest.approx(0.88921 * 1.005, rel=1e-3)


def test_the_interval_is_students() -> None:
    low, high = confidence_interval(np.array([1.0, 2.0, 3.0]))
    assert low is not None
    assert high is not None
    assert (low, high) == (
        pytest.approx(2.0 - 4.3027 / math.sqrt(3), abs=1e-4),
        pytest.approx(2.0 + 4.3027 / math.sqrt(3), abs=1e-4),
    )
    assert confidence_interval(np.array([1.0])) == (None, None)


def test_the_papers_statements_hold_for_its_own_figures_and_fail_for_others() -> None:
    assert [check.holds for check in checks(table(made_up(papers())))] == [True, True, True]
    turned = papers() | {("m0_m", "SIR"): 0.01, ("position_m", "SFE"): 0.01}
    assert [check.holds for check in checks(table(made_up(turned)))] == [False, False, False]
    assert checks([e for e in table(made_up(papers())) if e["movement"] != "SIR"]) == []


def test_statements_about_whole_movements_are_not_judged_on_their_first_seconds() -> None:
    entries = table(made_up(papers()))
    assert [check.holds for check in checks(entries, 2.0)] == [None, None, None]
    assert "Not judged: only the first 2 s of each movement was played" in checks(entries, 2.0)[0].explanation
    assert [check.holds for check in checks(entries, 31.0)] == [True, True, True]


def test_the_figures_behind_a_statement_are_named_in_words() -> None:
    m1_and_arm = checks(table(made_up(papers())))[1]
    assert m1_and_arm.evidence.startswith("marker m1: SAbAd 1.76 mm, ")
    assert "position of the arm: SAbAd 1.1 mm" in m1_and_arm.evidence
    assert "_" not in m1_and_arm.evidence


def test_a_method_that_never_saw_the_marker_leaves_a_gap_in_table_and_figure() -> None:
    rows = made_up(papers(), seeds=1)
    for row in rows[:4]:
        row.update({"rms": None, "sd": None, **dict.fromkeys(BOX)})
    entries = {(e["quantity"], e["movement"]): e for e in table(rows)}
    assert entries["m0_m", "SAbAd"]["rms"] is None
    assert entries["m0_m", "SFE"]["rms"] is not None
    draw_figure_13(rows, "paper")


def test_the_command_writes_tables_summary_and_figures_and_prints_one_document(tmp_path: Path) -> None:
    motion = tmp_path / "reach.mot"
    rows = [f"{0.05 * k:.2f} {20 * np.sin(0.3 * k):.3f} {40 + 2 * k} 10" for k in range(12)]
    motion.write_text("\n".join(["inDegrees=yes", "endheader", "time plane_elv shoulder_elv axial_rot", *rows]))
    arguments = ["study", "accuracy", "--out", str(tmp_path), "--movement", "SFE", "--motion", str(motion), "--duration", "0.3"]
    arguments += ["--sensor", "paper", "--method", "paper", "--method", "refined", "--seeds", "2", "--workers", "1"]
    result = CliRunner().invoke(app, [*arguments, "--json"], catch_exceptions=False)
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    assert {e["movement"] for e in document["table"]} == {"SFE", "reach", "mean"}
    best = {e["method"]: e["rms"] for e in document["table"] if (e["movement"], e["quantity"]) == ("mean", "orientation_deg")}
    assert best["refined"] < 0.2 * best["paper"]
    folder = tmp_path / "accuracy"
    assert json.loads((folder / "summary.json").read_text()) == document
    with (folder / "rows.csv").open() as file:
        written = list(csv.DictReader(file))
    assert len(written) == 2 * 2 * 2 * 4
    assert parquet.read_table(folder / "rows.parquet").num_rows == len(written)
    for ending in ("png", "svg", "pdf"):
        assert (folder / "figures" / f"figure13_paper.{ending}").stat().st_size > 5000
    image = cv2.imread(str(folder / "figures" / "figure13_paper.png"))
    assert image is not None
    assert image.std() > 20
    tasks = sorted((tmp_path / "tasks").iterdir())
    again = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert "refined" in again.stdout
    assert sorted((tmp_path / "tasks").iterdir()) == tasks


def test_what_cannot_be_studied_is_refused(tmp_path: Path) -> None:
    def run(*arguments: str) -> None:
        CliRunner().invoke(app, ["study", "accuracy", "--out", str(tmp_path), *arguments], catch_exceptions=False)

    with pytest.raises(BadInputError, match="study compare"):
        run("--method", "aruco")
    with pytest.raises(BadInputError, match="cannot be read"):
        run("--motion", str(tmp_path / "none.mot"))
