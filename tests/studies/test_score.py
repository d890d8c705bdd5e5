"""Score and picture of a shipped recording."""

import json
import re
from pathlib import Path

import cv2
import matplotlib as mpl
import pytest
from typer.testing import CliRunner

from ghest_rt.cli.main import app
from ghest_rt.errors import BadInputError
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.faults import parse_fault
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.studies.picture import draw_recording
from ghest_rt.studies.score import score_recording

FIXTURES = Path(__file__).resolve().parents[2] / "sim_fixtures"


@pytest.mark.parametrize("movement", ["SAbAd", "SFE", "SIR", "COMB"])
def test_refined_is_many_times_better_than_the_papers_steps_on_the_same_images(movement: str) -> None:
    path = FIXTURES / f"{movement}.mcap"
    refined, paper = score_recording(path, "refined"), score_recording(path, "paper")
    assert refined.valid_fraction > 0.99
    assert refined.orientation_rmse_deg < 0.05
    assert refined.position_rmse_m < 0.1e-3
    assert 0.25 < paper.orientation_rmse_deg < 1.5
    assert paper.orientation_rmse_deg > 10 * refined.orientation_rmse_deg


def test_what_is_lost_is_told_by_reason_and_the_errors_are_of_the_rest(tmp_path: Path) -> None:
    out = tmp_path / "a.mcap"
    blind = parse_fault("blind:r1:0.3:0.4")
    simulate(SimulateOptions(out=out, movement="SFE", duration_s=1.0, seed=2, faults=(blind,)), lambda _: None)
    score = score_recording(out, "refined")
    assert set(score.lost) == {"m1_not_seen"}
    assert score.lost["m1_not_seen"] / (score.samples - score.starting) == pytest.approx(1.0 - score.angles_fraction)
    assert 0.2 < 1.0 - score.angles_fraction < 0.45
    assert score.valid_fraction <= score.angles_fraction
    assert score.orientation_rmse_deg < 0.05


def test_a_method_that_finds_nothing_is_told() -> None:
    told = r"SFE.mcap: method aruco finds nothing to compare with the truth, \d+ samples, m0_not_seen x\d+; is it the method"
    with pytest.raises(BadInputError, match=told):
        score_recording(FIXTURES / "SFE.mcap", "aruco")


def test_the_table_says_how_much_was_lost_and_why(tmp_path: Path) -> None:
    out = tmp_path / "a.mcap"
    simulate(
        SimulateOptions(out=out, movement="SFE", duration_s=0.5, faults=(parse_fault("blind:r0:0.3:0.1"),)), lambda _: None
    )
    result = CliRunner().invoke(app, ["score", str(out), "--method", "paper"])
    assert result.exit_code == 0, result.output
    assert "angles" in result.stdout
    assert "a.mcap: lost: m0_not_seen x" in result.stdout


def test_the_manifest_describes_the_shipped_files() -> None:
    import hashlib

    entries = json.loads((FIXTURES / "manifest.json").read_text())["recordings"]
    assert {entry["file"] for entry in entries} == {path.name for path in FIXTURES.glob("*.mcap")}
    for entry in entries:
        assert hashlib.sha256((FIXTURES / entry["file"]).read_bytes()).hexdigest() == entry["sha256"]
        assert entry["file"] in entry["command"]
    assert sum((FIXTURES / entry["file"]).stat().st_size for entry in entries) < 30e6


def test_the_picture_is_drawn_and_a_wrong_ending_refused(tmp_path: Path) -> None:
    shares: list[float] = []
    draw_recording(FIXTURES / "SFE.mcap", tmp_path / "sfe.png", progress=shares.append)
    image = cv2.imread(str(tmp_path / "sfe.png"))
    assert image is not None
    assert image.shape[1] > 1000
    assert image.std() > 20
    assert shares == sorted(shares)
    with pytest.raises(BadInputError, match=r"\.png, \.svg or \.pdf"):
        draw_recording(FIXTURES / "SFE.mcap", tmp_path / "sfe.gif")
    with pytest.raises(BadInputError, match=r"sfe.svg: cannot be written: No such file or directory"):
        draw_recording(FIXTURES / "SFE.mcap", tmp_path / "none" / "sfe.svg")


def test_the_picture_names_what_it_shows_in_order_and_says_what_was_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(mpl.rcParams, "svg.fonttype", "path")  # whatever other figures have set
    out = tmp_path / "a.mcap"
    blind = parse_fault("blind:r1:0.2:0.5")
    simulate(SimulateOptions(out=out, movement="SFE", duration_s=0.8, faults=(blind,), seed=7), lambda _: None)
    draw_recording(out, tmp_path / "a.svg", "refined")
    # Text is drawn as outlines, each after a comment with what it says.
    said = [line.strip() for line in (tmp_path / "a.svg").read_text().splitlines() if line.strip().startswith("<!--")]
    legend = [re.sub(r"<!-- (\w+).* -->", r"\1", line) for line in said]
    at = legend.index("flexion")
    assert legend[at : at + 6] == ["flexion", "abduction", "rotation", "truth", "degraded", "lost"]
    assert "<!-- a.mcap: method refined, movement SFE, sensor paper, seed 7 -->" in said
    assert "<!-- camera r1: marker m1 not found -->" in said


def test_a_recording_of_one_sample_is_no_picture(tmp_path: Path) -> None:
    out = tmp_path / "a.mcap"
    simulate(SimulateOptions(out=out, movement="SFE", duration_s=0.01), lambda _: None)
    with pytest.raises(BadInputError, match=r"a.mcap: too short for a picture, which takes 2 samples: there is 1"):
        draw_recording(out, tmp_path / "a.png")
    assert not (tmp_path / "a.png").exists()
