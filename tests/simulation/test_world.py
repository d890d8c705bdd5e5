"""The clinic in motion: what follows what, what the sensors deliver and when."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import mujoco
import numpy as np
import pytest

from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import angle_between_rad
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.scene import exoskeleton_spec
from ghest_rt.simulation.sensors import PAPER
from ghest_rt.simulation.therapy import MOVEMENTS, TherapyMotion
from ghest_rt.simulation.world import World

MakeWorld = Callable[..., World]


def link_poses(world: World, t_ns: int) -> dict[str, np.ndarray]:
    """Forward kinematics of the URDF alone, from the true joint positions."""
    model = exoskeleton_spec(world.station.urdf_text, "urdf").compile()
    data = mujoco.MjData(model)
    for name, value in world.truth_at(t_ns).joints_rad.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    return {model.body(k).name: transform(data.xmat[k].reshape(3, 3), data.xpos[k]) for k in range(model.nbody)}


def times(world: World, count: int) -> list[int]:
    return [int(t) for t in np.linspace(world.timeline.start_ns, world.timeline.end_ns, count)]


@pytest.mark.parametrize("arm", ["right", "left"])
def test_markers_and_arm_are_where_the_calibration_says(make_world: MakeWorld, arm: str) -> None:
    world = make_world(arm=arm)
    calibration = world.station.config.calibration
    for t_ns in times(world, 5):
        truth = world.truth_at(t_ns)
        gh = truth.e_from_m0 @ np.array(calibration.m0_from_gh)
        elw = truth.e_from_m1 @ np.array(calibration.m1_from_elw)
        along = gh[:3, 3] - elw[:3, 3]
        assert np.linalg.norm(along) == pytest.approx(0.186 * 1.75)
        np.testing.assert_allclose(truth.e_from_arm[:3, 3], (gh[:3, 3] + elw[:3, 3]) / 2, atol=1e-9)
        np.testing.assert_allclose(truth.e_from_arm[:3, 2], along / np.linalg.norm(along), atol=1e-9)
        np.testing.assert_allclose(elw[:3, 1], truth.e_from_arm[:3, 2], atol=1e-9)
        np.testing.assert_allclose(elw[:3, 0], truth.e_from_arm[:3, 0], atol=1e-9)
        np.testing.assert_allclose(inverse(truth.e_from_m0) @ truth.e_from_arm, truth.m0_from_arm, atol=1e-9)
        np.testing.assert_allclose((inverse(gh) @ truth.e_from_arm)[:3, :3], truth.gh_from_arm, atol=1e-9)


def test_the_truth_holds_the_movement_s_gh_rotation(make_world: MakeWorld) -> None:
    world = make_world()
    motion = TherapyMotion(MOVEMENTS["COMB"], 4)
    for t_ns in times(world, 7):
        expected = motion.at((t_ns - world.timeline.start_ns) * 1e-9).gh
        np.testing.assert_allclose(world.truth_at(t_ns).gh_from_arm, expected, atol=1e-9)


def test_the_exoskeleton_follows_elbow_and_forearm(make_world: MakeWorld) -> None:
    world = make_world()
    offsets, tilts = [], []
    for t_ns in times(world, 9):
        truth, links = world.truth_at(t_ns), link_poses(world, t_ns)
        elbow = truth.e_from_arm @ (0.0, 0.0, -0.186 * 1.75 / 2, 1.0)
        offsets.append(truth.e_from_arm[:3, :3].T @ (links["l5"][:3, 3] - elbow[:3]))
        np.testing.assert_allclose(links["l4"][:3, :3] @ (1, 0, 0), (1, 0, 0), atol=1e-9)  # the coupler stays level
        camera = links["l8"] @ world.station.config.calibration.link_from_camera_array("r1")
        tilts.append(np.degrees(np.arccos(-(camera[:3, 2] @ truth.e_from_m1[:3, 2]))))
    np.testing.assert_allclose(offsets, np.broadcast_to(offsets[0], (9, 3)), atol=2e-5)
    assert 0.005 < np.linalg.norm(offsets[0]) < 0.03
    assert max(tilts) < 20.0  # m1 keeps facing r1


def test_the_exoskeleton_s_angles_are_not_the_arm_s(make_world: MakeWorld) -> None:
    world = make_world(duration_s=12.0)
    of_joints, of_arm = [], []
    for t_ns in times(world, 60):
        truth = world.truth_at(t_ns)
        of_joints.append(truth.joints_rad["j0"] + truth.joints_rad["j1"])
        of_arm.append(-np.arcsin(truth.gh_from_arm[1, 2]))
    error = np.degrees(np.array(of_joints) - of_arm)
    assert np.std(error) > 3.0  # beyond any constant offset


@pytest.mark.parametrize(("sensor", "range_m"), [("paper", (0.20, 0.28)), ("sr300", (0.24, 0.30))])
@pytest.mark.parametrize("movement", list(MOVEMENTS))
def test_the_markers_stay_in_view_with_20_mm_to_spare(
    make_world: MakeWorld, sensor: str, movement: str, range_m: tuple[float, float]
) -> None:
    world = make_world(sensor=sensor, movement=movement, duration_s=None)
    for camera, marker in (("r0", "e_from_m0"), ("r1", "e_from_m1")):
        k = world.camera_info(camera).color
        link_from_camera = world.station.config.calibration.link_from_camera_array(camera)
        half = world.station.config.markers["m0"].plate_m / 2
        corners = np.array([(x, y, 0.0, 1.0) for x in (-half, half) for y in (-half, half)]).T
        for t_ns in times(world, 40):
            link = np.eye(4) if camera == "r0" else link_poses(world, t_ns)["l8"]
            seen = inverse(link @ link_from_camera) @ getattr(world.truth_at(t_ns), marker) @ corners
            u, v = k.fx_px * seen[0] / seen[2] + k.cx_px, k.fy_px * seen[1] / seen[2] + k.cy_px
            spare_px = min(u.min() + 0.5, k.width_px - 0.5 - u.max(), v.min() + 0.5, k.height_px - 0.5 - v.max())
            assert spare_px / k.fx_px * seen[2].mean() > 0.02
            assert range_m[0] < seen[2].min() < seen[2].max() < range_m[1]


def test_a_patient_too_tall_for_the_settings_cannot_be_followed() -> None:
    station = load_station(shipped_config_dir() / "station-sim.toml")
    text = station.toml_text.replace("j3_length = 0.145", "j3_length = 0.0")
    config = station.config.model_copy(
        update={
            "exoskeleton": station.config.exoskeleton.model_copy(
                update={"settings_m": {"j3_length": 0.0, "j5": 0.0, "j7": 0.0}}
            )
        }
    )
    short = replace(station, toml_text=text, config=config)
    motion = TherapyMotion(MOVEMENTS["COMB"], 1)
    with pytest.raises(GhestError, match=r"cannot follow the patient at .* check exoskeleton.settings_m"):
        World(short, anatomy(2.0), motion, PAPER, seed=1, duration_s=5.0)


def test_paper_frames_are_on_the_exact_grid_and_as_many_as_table_2_says(make_world: MakeWorld) -> None:
    world = make_world(duration_s=None)
    assert [world.frame_count(name) for name in world.camera_names] == [2000, 2000]
    assert world.frame("r0", 2000) is None
    first = round(world.timeline.start_ns * 66.6e-9)
    for k in (0, 1, 777, 1999):
        assert world.frame_times("r0", k) == world.frame_times("r1", k)
        assert world.frame_times("r0", k).color_ns == round((first + k) * 1e9 / 66.6)


def test_sr300_cameras_run_at_60_hz_out_of_phase_with_small_errors_of_their_stamps(make_world: MakeWorld) -> None:
    world = make_world(sensor="sr300")
    stamps = [[world.frame_times(camera, k) for k in range(world.frame_count(camera))] for camera in ("r0", "r1")]
    np.testing.assert_allclose(np.diff([t.color_ns for t in stamps[0]]), 1e9 / 60, atol=1.0)
    errors_ms = np.array([t.stamp_error_ns * 1e-6 for camera in stamps for t in camera])
    assert 0.1 < errors_ms.std() < 0.2
    latency_ms = np.array([(t.arrival_ns - t.color_ns) * 1e-6 for camera in stamps for t in camera])
    assert 20 < latency_ms.mean() < 24
    assert 1 < latency_ms.std() < 3
    apart_ms = abs(stamps[0][0].color_ns - stamps[1][0].color_ns) * 1e-6
    assert apart_ms > 0.5
    assert all(t.depth_ns - t.color_ns == 3_000_000 for t in stamps[0])


def test_encoder_rows_have_a_real_armeo_s_timing(make_world: MakeWorld) -> None:
    world = make_world(duration_s=None, sensor="sr300")
    rows = [world.encoder_sample(k) for k in range(world.encoder_count)]
    assert world.encoder_sample(world.encoder_count) is None
    t_ms = np.array([row.t_capture_ns for row in rows if row]) * 1e-6
    gaps = np.diff(t_ms)
    repeated = gaps <= 2.0
    assert 0.003 < repeated.mean() < 0.02
    proper = np.diff(np.delete(t_ms, np.flatnonzero(repeated) + 1))
    assert proper.mean() == pytest.approx(15.60, abs=0.1)
    assert proper.std() == pytest.approx(0.66, rel=0.1)
    for k in np.flatnonzero(repeated):
        np.testing.assert_array_equal(rows[k].angles_rad, rows[k + 1].angles_rad)  # type: ignore[union-attr]
    assert [row.seq for row in rows if row] == list(range(len(rows)))
    assert t_ms[0] < world.timeline.start_ns * 1e-6
    assert t_ms[-1] > world.timeline.end_ns * 1e-6


def test_encoders_tell_the_true_angles_to_their_resolution(make_world: MakeWorld) -> None:
    ideal, coarse = make_world(), make_world(sensor="sr300")
    names = ideal.encoder_info().joint_names
    row = ideal.encoder_sample(40)
    assert row is not None
    truth = ideal.truth_at(row.t_capture_ns).joints_rad
    np.testing.assert_array_equal(row.angles_rad, [truth[name] for name in names])
    row = coarse.encoder_sample(40)
    assert row is not None
    step = 2 * np.pi / 2**14
    np.testing.assert_allclose(row.angles_rad / step, np.rint(row.angles_rad / step), atol=1e-6)
    truth = coarse.truth_at(row.t_capture_ns).joints_rad
    assert 0 < np.abs(row.angles_rad - [truth[name] for name in names]).max() <= step / 2 + 1e-12


def test_truth_goes_on_smoothly_before_and_after_the_movement(make_world: MakeWorld) -> None:
    world = make_world()
    ticks = world.truth_times_ns
    assert ticks.step == 5_000_000
    assert ticks[0] <= world.timeline.start_ns - 95_000_000
    assert ticks[-1] >= world.timeline.end_ns + 90_000_000
    rotations = [world.truth_at(t).gh_from_arm for t in ticks]
    steps = [angle_between_rad(a, b) for a, b in pairwise(rotations)]
    assert np.degrees(max(steps)) / 0.005 < 200.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"movement": None}, r"give either a movement \(--movement\) or a motion file"),
        ({"motion": Path("x.mot")}, r"give either a movement"),
        ({"sensor": "kinect"}, r"sensor 'kinect' is unknown: give one of paper, sr300"),
        ({"seed": -1}, r"--seed -1: give a whole number from 0 to"),
        ({"duration_s": 0.0}, r"--duration 0: give a positive number"),
        ({"brightness": 0.0}, r"give positive numbers"),
        ({"station": shipped_config_dir() / "station-sim-left.toml"}, r"station.arm is left, asked for is the right arm"),
    ],
)
def test_wrong_options_are_refused_with_the_remedy(make_world: MakeWorld, options: dict[str, object], message: str) -> None:
    with pytest.raises(BadInputError, match=message):
        make_world(**options)
