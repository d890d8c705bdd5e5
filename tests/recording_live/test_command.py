"""`ghest-rt record` as a user runs it, on the simulated station."""

import json
import subprocess
import time
from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="needs the extra sim")

from tests.cli.conftest import Run, ghest_rt
from tests.program import COMMAND

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


def test_what_a_killed_command_has_recorded_can_be_estimated(ghest_rt: Run, tmp_path: Path) -> None:
    command = [*COMMAND, "record", "--station", STATION, "--out", tmp_path, "--no-publish"]
    recorder = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        deadline_s = time.monotonic() + 30.0
        while sum(file.stat().st_size for file in tmp_path.glob("*.mcap")) < 8_000_000:
            assert time.monotonic() < deadline_s
            time.sleep(0.05)
    finally:
        recorder.kill()
        recorder.wait(10)
    (path,) = tmp_path.glob("*.mcap")
    table = tmp_path / "angles.csv"
    estimated = ghest_rt("estimate", path, "--out", table, "--json")
    assert estimated.returncode == 0, estimated.stderr
    assert any("used up to there" in problem for problem in json.loads(estimated.stdout)["skipped"])
    assert len(table.read_text().splitlines()) > 20
