"""What the cameras see: colours and depth where geometry says, hidden by what is in the way."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest

from ghest_drivers.samples import Intrinsics
from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.geometry.se3 import inverse
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.building import build_world
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.simulation.rays import PixelRays
from ghest_rt.simulation.scene import exoskeleton_spec
from ghest_rt.simulation.sensors import PAPER, SENSOR_SETS, SR300
from ghest_rt.simulation.therapy import MOVEMENTS, TherapyMotion
from ghest_rt.simulation.world import World

MakeWorld = Callable[..., World]
CAMERAS = (("r0", "m0"), ("r1", "m1"))


def camera_from_marker(world: World, camera: str, t_ns: int) -> np.ndarray:
    """The pose by the URDF's forward kinematics and the calibration."""
    truth = world.truth_at(t_ns)
    model = exoskeleton_spec(world.station.urdf_text, "urdf").compile()
    data = mujoco.MjData(model)
    for name, value in truth.joints_rad.items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    body = data.body(world.station.config.cameras[camera].link)
    link = np.eye(4)
    link[:3, :3], link[:3, 3] = body.xmat.reshape(3, 3), body.xpos
    marker = truth.e_from_m0 if camera == "r0" else truth.e_from_m1
    return inverse(link @ world.station.config.calibration.link_from_camera_array(camera)) @ marker


def project(points_m: np.ndarray, k: Intrinsics) -> np.ndarray:
    return cv2.projectPoints(points_m[:, None], np.zeros(3), np.zeros(3), k.matrix, np.array(k.distortion))[0][:, 0]


def disk_centers_m(world: World, marker: str) -> np.ndarray:
    a = world.station.config.markers[marker].half_spacing_m
    return np.array([(a, -a, 0, 1), (-a, -a, 0, 1), (a, a, 0, 1), (-a, a, 0, 1)], dtype=float)  # eq. (5)


@pytest.mark.parametrize("sensor", list(SENSOR_SETS))
@pytest.mark.parametrize("arm", ["right", "left"])
def test_the_disks_are_where_their_centres_project_and_have_their_colours(make_world: MakeWorld, sensor: str, arm: str) -> None:
    world = make_world(sensor=sensor, arm=arm)
    for camera, marker in CAMERAS:
        t_ns = world.timeline.start_ns + 700_000_000
        frame = world.render(camera, t_ns)
        centers = (camera_from_marker(world, camera, t_ns) @ disk_centers_m(world, marker).T)[:3].T
        for uv, nominal in zip(project(centers, frame.info.color), world.station.config.markers[marker].disk_rgb, strict=True):
            u, v = np.rint(uv).astype(int)
            seen = frame.color_rgb[v - 1 : v + 2, u - 1 : u + 2].reshape(-1, 3).mean(axis=0)
            hue = seen / np.linalg.norm(seen)
            assert hue @ nominal / np.linalg.norm(nominal) > 0.99


def test_disk_edges_are_smooth_to_a_hundredth_of_a_pixel(make_world: MakeWorld) -> None:
    world = make_world()
    for camera, marker in CAMERAS:
        t_ns = world.timeline.start_ns + 900_000_000
        frame = world.render(camera, t_ns)
        pose = camera_from_marker(world, camera, t_ns)
        plate = frame.color_rgb.astype(float)
        turn = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
        for center in disk_centers_m(world, marker)[:, :2]:
            rim = np.column_stack((center + 0.008 * np.column_stack((np.cos(turn), np.sin(turn))), np.zeros(720), np.ones(720)))
            outline = project((pose @ rim.T)[:3].T, frame.info.color)
            area = 0.5 * np.abs(outline[:, 0] @ np.roll(outline[:, 1], 1) - outline[:, 1] @ np.roll(outline[:, 0], 1))
            (u0, v0), (u1, v1) = np.floor(outline.min(axis=0)).astype(int) - 1, np.ceil(outline.max(axis=0)).astype(int) + 2
            patch = plate[v0:v1, u0:u1]
            u, v = np.rint(project(pose[None, :3, 3], frame.info.color)[0]).astype(int)
            white, middle = plate[v, u], np.rint(outline.mean(axis=0)).astype(int) - (u0, v0)
            ink = patch[middle[1], middle[0]] - white
            cover = (patch - white) @ ink / (ink @ ink)
            rows, columns = np.mgrid[v0:v1, u0:u1]
            cover[np.hypot(columns - outline[:, 0].mean(), rows - outline[:, 1].mean()) > np.sqrt(area / np.pi) + 1.5] = 0.0
            center_of_area = np.array([(cover * columns).sum(), (cover * rows).sum()]) / cover.sum()
            assert cover.sum() == pytest.approx(area, rel=0.005)
            moments = _area_center(outline)
            assert np.abs(center_of_area - moments).max() < 0.012


def _area_center(outline: np.ndarray) -> np.ndarray:
    x, y = outline.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    return np.array([((x + np.roll(x, -1)) * cross).sum(), ((y + np.roll(y, -1)) * cross).sum()]) / (3 * cross.sum())


@pytest.mark.parametrize("sensor", list(SENSOR_SETS))
def test_depth_on_the_plate_is_the_plane_s(make_world: MakeWorld, sensor: str) -> None:
    world = make_world(sensor=sensor)
    for camera, _ in CAMERAS:
        t_ns = world.timeline.start_ns + 500_000_000
        frame = world.render(camera, t_ns)
        info = frame.info
        pose = inverse(info.color_from_depth) @ camera_from_marker(world, camera, t_ns)
        inner = np.array([(x, y, 0, 1) for x in (-0.025, 0, 0.025) for y in (-0.025, 0, 0.025)])
        rays = PixelRays(info.depth)
        errors = []
        for u, v in np.rint(project((pose @ inner.T)[:3].T, info.depth)).astype(int):
            block = np.mgrid[v - 2 : v + 3, u - 2 : u + 3].reshape(2, -1).T
            for row, column in block:
                counts = frame.depth_counts[row, column]  # type: ignore[index]
                if counts:
                    ray = np.array([rays.x[row, column], rays.y[row, column], 1.0])
                    z_m = pose[:3, 2] @ pose[:3, 3] / (pose[:3, 2] @ ray)
                    errors.append(counts * info.depth_unit_m - z_m)
        if sensor == "paper":
            assert len(errors) == 9 * 25
            assert np.abs(errors).max() <= info.depth_unit_m / 2 + 1e-12
        else:
            assert len(errors) > 9 * 25 * 0.95
            assert abs(np.mean(errors)) < 0.0001
            assert np.std(errors) == pytest.approx(0.0005, rel=0.2)


def test_depth_is_measured_within_the_sensor_s_range_only(make_world: MakeWorld) -> None:
    for sensor, (low, high) in {"paper": (0.05, 0.3), "sr300": (0.2, 1.5)}.items():
        world = make_world(sensor=sensor)
        for camera, _ in CAMERAS:
            frame = world.render(camera, world.timeline.start_ns)
            assert frame.depth_counts is not None
            depth_m = frame.depth_counts * frame.info.depth_unit_m
            measured = depth_m[depth_m > 0]
            assert 0.02 < len(measured) / depth_m.size < 0.98
            assert low - 0.003 < measured.min() < measured.max() < high + 0.003


def test_an_obstacle_in_front_of_the_marker_hides_it() -> None:
    station = load_station(shipped_config_dir() / "station-sim.toml")
    # A bar of 12 mm, fixed to the base, crosses the view of r0 at 50 mm in front of the lower half of m0.
    bar = '<visual><origin xyz="0.077 0.035 -0.015"/><geometry><box size="0.012 0.20 0.012"/></geometry>'
    bar += '<material name="cuff"/></visual>'
    blocked = replace(station, urdf_text=station.urdf_text.replace('<link name="l0">', f'<link name="l0">{bar}', 1))
    motion = TherapyMotion(MOVEMENTS["SIR"], 1)
    free, hidden = (World(s, anatomy(1.75), motion, PAPER, seed=1, duration_s=0.1) for s in (station, blocked))
    t_ns = free.timeline.start_ns
    open_view, view = free.render("r0", t_ns), hidden.render("r0", t_ns)
    centers = (camera_from_marker(free, "r0", t_ns) @ disk_centers_m(free, "m0").T)[:3].T
    for uv, z_m, is_low in zip(project(centers, view.info.color), centers[:, 2], (False, True, False, True), strict=True):
        u, v = np.rint(uv).astype(int)
        assert open_view.depth_counts is not None and view.depth_counts is not None
        assert open_view.depth_counts[v, u] * 1e-5 == pytest.approx(z_m, abs=1e-3)
        if is_low:
            assert view.depth_counts[v, u] * 1e-5 < z_m - 0.03
            assert view.color_rgb[v, u].max() < 80  # the bar's dark grey
        else:
            np.testing.assert_array_equal(view.color_rgb[v, u], open_view.color_rgb[v, u])


def test_sr300_colour_noise_and_vignetting(make_world: MakeWorld) -> None:
    world = make_world(sensor="sr300")
    start = world.timeline.start_ns
    one, two = (world.render("r0", start + dt).color_rgb.astype(float) for dt in (0, 1))
    wall = (slice(20, 120), slice(400, 600))
    assert (one[wall] - two[wall]).std() / np.sqrt(2) == pytest.approx(4.0, rel=0.05)
    assert one[100:140, 560:].mean() < one[100:140, 380:420].mean() - 5


def test_light_changes_the_picture_as_asked(make_world: MakeWorld) -> None:
    plain, changed = make_world(), make_world(brightness=0.7, white_balance=(1.2, 1.0, 0.8))
    t_ns = plain.timeline.start_ns
    one, two = (w.render("r0", t_ns).color_rgb.astype(float) for w in (plain, changed))
    np.testing.assert_allclose(two, one * 0.7 * np.array([1.2, 1.0, 0.8]), atol=1.0)


def test_movement_during_the_exposure_blurs() -> None:
    quiet = replace(SR300.camera, color_noise=0.0, light_drift=0.0, vignetting=0.0, exposure_s=0.0)
    station = load_station(shipped_config_dir() / "station-sr300-sim.toml")
    motion = TherapyMotion(MOVEMENTS["SFE"], 1)
    views = []
    speeds = [abs(motion.angles_rad(t + 0.1)[0] - motion.angles_rad(t)[0]) for t in np.arange(0.0, 4.0, 0.1)]
    fastest_ns = 100_000_000 * int(np.argmax(speeds)) + 50_000_000
    for exposure_s in (0.0, 0.1, 0.2):
        sensors = replace(SR300, camera=replace(quiet, exposure_s=exposure_s))
        world = World(station, anatomy(1.75), motion, sensors, seed=1, duration_s=5.0)
        views.append(world.render("r1", world.timeline.start_ns + fastest_ns).color_rgb.astype(float))
    little, more = (int((np.abs(view - views[0]).max(axis=2) > 20).sum()) for view in views[1:])
    assert 50 < little < more


@pytest.mark.parametrize("sensor", list(SENSOR_SETS))
def test_aruco_texture_is_read_with_its_number_and_the_marker_s_axes(make_world: MakeWorld, sensor: str) -> None:
    world = make_world(sensor=sensor, marker="aruco")
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    for number, (camera, _) in enumerate(CAMERAS):
        t_ns = world.timeline.start_ns + 300_000_000
        frame = world.render(camera, t_ns)
        corners, ids, _ = detector.detectMarkers(cv2.cvtColor(frame.color_rgb, cv2.COLOR_RGB2GRAY))
        assert ids.ravel().tolist() == [number]
        half = 0.026  # half spacing + disk radius
        square = np.array([(-half, half, 0, 1), (half, half, 0, 1), (half, -half, 0, 1), (-half, -half, 0, 1)])
        expected = project((camera_from_marker(world, camera, t_ns) @ square.T)[:3].T, frame.info.color)
        assert np.abs(corners[0][0] - expected).max() < 1.5


@pytest.mark.parametrize("sensor", list(SENSOR_SETS))
def test_frames_do_not_depend_on_the_order_of_asking(sensor: str) -> None:
    options = SimulateOptions(out=Path("unused"), movement="SFE", sensor=sensor, seed=9, duration_s=0.5)  # type: ignore[arg-type]
    one, two = build_world(options), build_world(options)
    first = [one.frame("r1", k) for k in (3, 7)]
    second = [two.frame("r1", k) for k in (7, 3)][::-1]
    for a, b in zip(first, second, strict=True):
        assert a is not None and b is not None
        assert a.color_rgb.tobytes() == b.color_rgb.tobytes()
        assert a.depth_counts.tobytes() == b.depth_counts.tobytes()  # type: ignore[union-attr]
        assert a.t_capture_ns == b.t_capture_ns
    other = build_world(replace(options, seed=10)).frame("r1", 3)
    assert other is not None and first[0] is not None
    assert other.color_rgb.tobytes() != first[0].color_rgb.tobytes()
