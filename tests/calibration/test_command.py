"""`ghest-rt calibrate` as a user runs it: a spoilt station file is put right, and what cannot be used is told with a remedy."""

import json
import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from ghest_rt.calibration.station_text import rigid_rows, with_calibration
from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import angle_between_rad, exp_so3
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.studies.score import run_with_truth
from tests.cli.recordings import write_blank_recording
from tests.program import COMMAND


def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [*COMMAND, "calibrate", *map(str, arguments)], capture_output=True, text=True, timeout=120, check=False
    )


def spoil(station_file: Path, out: Path) -> Path:
    """Write the station file with centres 15 mm and attitudes 5° off."""
    station = load_station(station_file)
    old = station.config.calibration
    off = transform(exp_so3(math.radians(5.0) * np.array([0.6, 0.0, 0.8])), 0.015 * np.array([0.0, -0.6, 0.8]))
    changes = {
        "m0_from_gh": rigid_rows(np.array(old.m0_from_gh) @ off),
        "m1_from_elw": rigid_rows(np.array(old.m1_from_elw) @ off),
    }
    out.write_text(with_calibration(station.toml_text, station.source, old.model_copy(update=changes), "by nobody"))
    return out


def rotation_error_deg(recording: Path, station_file: Path) -> float:
    """RMS error of the GH rotation by method fused, with that station file."""
    judged = run_with_truth(recording, "fused", load_station(station_file))
    errors = [
        angle_between_rad(true.gh_from_arm, estimate.gh_from_arm)
        for estimate in judged.estimates
        if estimate.gh_from_arm is not None and (true := judged.truth.at(estimate.t_sample_ns)) is not None
    ]
    return math.degrees(math.sqrt(np.mean(np.square(errors))))


@pytest.mark.slow
def test_a_spoilt_station_measures_again_as_the_true_one_does(recorded: Path, folder: Path) -> None:
    true_file, spoilt = folder / "station-sim.toml", spoil(folder / "station-sim.toml", folder / "spoilt.toml")
    done = run(recorded, "--station", spoilt, "--out", folder / "new.toml", "--picture", folder / "residuals.png", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["objections"] == []
    assert document["residual_rms_m"] < 0.001
    assert (folder / "residuals.png").stat().st_size > 10_000
    new = load_station(folder / "new.toml").config
    true = load_station(true_file).config
    assert np.array(new.calibration.m0_from_gh)[:3, 3] == pytest.approx(
        np.array(true.calibration.m0_from_gh)[:3, 3], abs=0.0005
    )
    assert new.calibration.id == "tuesday"
    assert new.model_copy(update={"calibration": true.calibration}) == true

    later = folder / "later.mcap"
    simulate(SimulateOptions(out=later, movement="COMB", seed=12, duration_s=4.0), lambda _: None)
    assert rotation_error_deg(later, spoilt) > 4.0
    assert rotation_error_deg(later, folder / "new.toml") < rotation_error_deg(later, true_file) + 0.3


@pytest.mark.slow
def test_the_table_says_what_changed_and_what_the_session_cannot_tell(recorded: Path, folder: Path) -> None:
    done = run(
        recorded, "--station", folder / "station-sim.toml", "--out", folder / "new.toml", "--arm-length", 0.33, "--id", "w1"
    )
    assert done.returncode == 0, done.stderr
    said = " ".join(done.stdout.split())
    for words in (
        "GH centre in m0",
        "range of motion: flexion",
        "mm RMS",
        "kept from the station file: link_from_camera",
        "verdict: good",
    ):
        assert words in said
    assert load_station(folder / "new.toml").config.calibration.arm_length_m == 0.33


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("--json",)])
def test_a_full_standard_output_does_not_cost_the_new_file(recorded: Path, folder: Path, options: tuple[str, ...]) -> None:
    words = [recorded, "--station", folder / "station-sim.toml", "--out", folder / "new.toml", *options]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*COMMAND, "calibrate", *map(str, words)], stdout=full, stderr=subprocess.PIPE, text=True, timeout=120, check=False
        )
    assert done.returncode == 1
    assert "standard output: cannot be written to" in done.stderr
    assert "Traceback" not in done.stderr
    assert load_station(folder / "new.toml").config.calibration.id == "tuesday"


def test_a_name_that_no_station_file_takes_is_told_before_the_recording_is_opened(folder: Path) -> None:
    done = run(
        folder / "none.mcap", "--station", folder / "station-sim.toml", "--out", folder / "new.toml", "--id", "patient 1"
    )
    assert done.returncode == 2
    assert "--id 'patient 1': must be 1 to 64 letters" in done.stderr


def test_nothing_is_overwritten_unasked(folder: Path) -> None:
    before = (folder / "station-sim.toml").read_bytes()
    done = run("any.mcap", "--station", folder / "station-sim.toml", "--out", folder / "station-sim.toml")
    assert done.returncode == 2
    assert "--force" in done.stderr
    assert (folder / "station-sim.toml").read_bytes() == before


def test_a_session_in_which_nothing_is_seen_writes_nothing(folder: Path) -> None:
    blank = write_blank_recording(folder / "blank.mcap")
    done = run(blank, "--station", folder / "station-sim.toml", "--out", folder / "new.toml")
    assert done.returncode == 2
    assert "not good enough to calibrate by" in done.stderr
    assert "ghest-rt doctor" in done.stderr
    assert not (folder / "new.toml").exists()


def test_a_session_recorded_with_other_settings_is_refused(folder: Path) -> None:
    blank = write_blank_recording(folder / "blank.mcap")
    other = folder / "other.toml"
    other.write_text((folder / "station-sim.toml").read_text().replace("j3_length = 0.145", "j3_length = 0.160"))
    done = run(blank, "--station", other, "--out", folder / "new.toml")
    assert done.returncode == 2
    assert "exoskeleton.settings_m" in done.stderr


def test_a_file_that_could_not_find_its_urdf_is_refused(folder: Path) -> None:
    (folder / "elsewhere").mkdir()
    done = run("any.mcap", "--station", folder / "station-sim.toml", "--out", folder / "elsewhere" / "new.toml")
    assert done.returncode == 2
    assert "armeo_spring.urdf" in done.stderr


def test_a_file_that_could_not_find_its_identity_is_refused_until_it_is_there(folder: Path) -> None:
    station = folder / "station-sim.toml"
    station.write_text(station.read_text() + '\n[publisher]\nidentity = "bed-1"\n')
    assert load_station(station).config.publisher.identity == "bed-1"
    (folder / "bed-1").mkdir()
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    shutil.copy(folder / "armeo_spring.urdf", elsewhere)
    blank = write_blank_recording(folder / "blank.mcap")
    done = run(blank, "--station", station, "--out", elsewhere / "new.toml")
    assert done.returncode == 2
    assert "publisher.identity = 'bed-1'" in done.stderr
    assert f"write the new file beside {station}" in done.stderr
    (elsewhere / "bed-1").mkdir()
    assert "not good enough" in run(blank, "--station", station, "--out", elsewhere / "new.toml").stderr


def test_another_joint_than_the_shoulder_is_refused(folder: Path) -> None:
    knee = shipped_config_dir() / "examples" / "knee" / "station.toml"
    blank = write_blank_recording(folder / "blank.mcap")
    done = run(blank, "--station", knee, "--out", knee.with_name("new.toml"))
    assert done.returncode == 2
    assert "shoulder" in done.stderr
