"""`simulate`: the recording it writes."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ghest_drivers.samples import EncoderSample, RgbdFrame
from ghest_rt.errors import BadInputError
from ghest_rt.messages.results import TruthSample
from ghest_rt.recording.reader import Recording
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.options import SimulateOptions


def options(path: Path, **more: object) -> SimulateOptions:
    return replace(SimulateOptions(out=path, movement="COMB", seed=3, duration_s=0.3), **more)  # type: ignore[arg-type]


def digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.mark.parametrize(("sensor", "duration_s"), [("paper", 0.3), ("sr300", 0.06)])
def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(tmp_path: Path, sensor: str, duration_s: float) -> None:
    paths = [tmp_path / folder / "a.mcap" for folder in ("one", "two", "three")]
    for path, seed in zip(paths, (3, 3, 4), strict=True):
        path.parent.mkdir()
        simulate(options(path, sensor=sensor, seed=seed, duration_s=duration_s), lambda _: None)
    assert digest(paths[0]) == digest(paths[1])
    assert digest(paths[0]) != digest(paths[2])


def test_the_recording_holds_sensors_truth_and_the_station_fitted_to_the_patient(tmp_path: Path) -> None:
    heard: list[float] = []
    path = tmp_path / "a.mcap"
    summary = simulate(options(path, height_m=1.9, arm="left"), heard.append)
    recording = Recording(path)
    events = list(recording.events())
    frames = [event for event in events if isinstance(event, RgbdFrame)]
    rows = [event for event in events if isinstance(event, EncoderSample)]
    truths = [event for event in events if isinstance(event, TruthSample)]
    assert not list(recording.problems)
    assert summary.frames == {"r0": 20, "r1": 20}
    assert len(frames) == 40
    assert summary.encoder_samples == len(rows)
    assert summary.truth_samples == len(truths)
    assert summary.size_bytes == path.stat().st_size
    assert summary.duration_s == pytest.approx(0.3)
    arrivals = [e.t_ns if isinstance(e, TruthSample) else e.t_arrival_ns for e in events]
    assert arrivals == sorted(arrivals)
    assert recording.station.config.exoskeleton.settings_m["j3_length"] == pytest.approx(0.175)
    assert recording.station.config.station.arm == "left"
    assert recording.encoder_joints == ("j0", "j1", "j2", "j4", "j6", "j8", "j9")
    assert recording.facts["command"] == (
        "ghest-rt simulate --movement COMB --sensor paper --seed 3 --duration 0.3 --arm left --height 1.9 --out a.mcap"
    )
    assert heard == sorted(heard)
    assert heard[-1] == 1.0
    assert heard[0] < 0.5


def test_a_left_movement_is_the_right_one_in_the_mirror(tmp_path: Path) -> None:
    truths = {}
    for arm in ("right", "left"):
        simulate(options(tmp_path / f"{arm}.mcap", arm=arm, duration_s=0.05), lambda _: None)
        events = Recording(tmp_path / f"{arm}.mcap").events()
        truths[arm] = [event for event in events if isinstance(event, TruthSample)]
    mirror = np.diag([1.0, -1.0, 1.0])
    for right, left in zip(truths["right"], truths["left"], strict=True):
        assert right.t_ns == left.t_ns
        np.testing.assert_allclose(left.gh_from_arm, mirror @ right.gh_from_arm @ mirror, atol=1e-9)
        np.testing.assert_allclose(left.m0_from_arm[:3, 3], mirror @ right.m0_from_arm[:3, 3], atol=1e-9)
        for joint, value in right.joints_rad.items():
            assert left.joints_rad[joint] == pytest.approx(value, abs=1e-5)


def test_a_motion_file_is_recorded_under_its_name(tmp_path: Path) -> None:
    motion = tmp_path / "reach.mot"
    rows = [f"{0.05 * k:.2f} {20 * np.sin(0.3 * k):.3f} {40 + 2 * k} 10" for k in range(12)]
    motion.write_text("\n".join(["inDegrees=yes", "endheader", "time plane_elv shoulder_elv axial_rot", *rows]))
    path = tmp_path / "a.mcap"
    summary = simulate(options(path, movement=None, motion=motion, duration_s=None), lambda _: None)
    assert summary.motion == "reach"
    assert summary.duration_s == pytest.approx(0.55)
    assert Recording(path).facts["motion"] == "reach"


def test_a_folder_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"a.mcap: cannot write the recording: no such folder; make .*none first"):
        simulate(options(tmp_path / "none" / "a.mcap"), lambda _: None)
