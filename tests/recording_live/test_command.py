"""`ghest-rt record` as a user runs it, on the simulated station."""

import json
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="needs the extra sim")

from tests.cli.conftest import Run, ghest_rt

__all__ = ["ghest_rt"]

STATION = Path(__file__).parents[2] / "config" / "station-sim.toml"


def test_record_then_estimate(ghest_rt: Run, tmp_path: Path) -> None:
    ended = ghest_rt(
        "record", "--station", STATION, "--out", tmp_path / "new" / "folder", "--duration", "2", "--no-publish", "--json"
    )
    assert ended.returncode == 0, ended.stderr
    recording = json.loads(ended.stdout)["recording"]
    (path,) = recording["files"]
    assert Path(path).stat().st_size / 1e6 == pytest.approx(recording["megabytes"])
    assert recording["dropped"] == {} and recording["failure"] is None
    assert recording["written"]["/gh/angles"] > 60
    table = tmp_path / "angles.csv"
    estimated = ghest_rt("estimate", path, "--out", table, "--json")
    assert estimated.returncode == 0, estimated.stderr
    assert json.loads(estimated.stdout)["skipped"] == []
    assert len(table.read_text().splitlines()) > 60


def test_a_folder_that_cannot_be_made_is_bad_input(ghest_rt: Run, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    ended = ghest_rt("record", "--station", STATION, "--out", tmp_path / "file", "--no-publish")
    assert ended.returncode == 2
    assert "name another folder" in ended.stderr and "Traceback" not in ended.stderr
