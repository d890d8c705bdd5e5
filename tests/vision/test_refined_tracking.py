"""Method refined over time: tracking, loss and recovery, the planar ambiguity."""

import numpy as np
import pytest

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3
from ghest_rt.messages.results import MarkerStatus
from ghest_rt.vision.ellipses import ellipse
from ghest_rt.vision.factory import make_detector
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.planar_pose import homography, mirrored, poses_of_homography
from ghest_rt.vision.pose_fit import Centers
from ghest_rt.vision.solve import Solver
from tests.vision.scenes import MARKER, Scene, facing_pose, paper_camera, pose_error, render, sr300_camera

INFO = paper_camera()
LAYOUT = MarkerLayout.of(MARKER)


def _swing(t_s, speed=1.0):
    """A marker that turns and moves smoothly: up to 1 rad/s and 80 mm/s at speed 1."""
    base = facing_pose(0.3, 0.6, 0.1, [0.0, 0.0, 0.18])
    turn = exp_so3(np.array([0.2, 0.3, -0.25]) * np.sin(2.5 * speed * t_s))
    return transform(turn @ base[:3, :3], base[:3, 3] + np.array([0.012, -0.01, 0.008]) * np.sin(4 * speed * t_s + 0.5))


def _run(detector, frames, *, speed=1.0, info=INFO, gains=lambda t_s: (1.0, 1.0, 1.0), **kwargs):
    for k in range(frames):
        t_s = k * 0.015
        scene = Scene(_swing(t_s, speed), gains=gains(t_s), **kwargs)
        yield scene, detector.detect(render(scene, info, np.random.default_rng(k), seq=k, t_ns=round(t_s * 1e9), samples=3))


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_a_moving_marker_is_followed(speed):
    detector = make_detector("refined", "r0", "m0", MARKER, INFO)
    errors = []
    for k, (scene, seen) in enumerate(_run(detector, 40, speed=speed, color_noise=2.0)):
        assert seen.status is MarkerStatus.OK
        assert seen.disks_used == 4
        assert (seen.camera, seen.marker, seen.seq, seen.t_capture_ns) == ("r0", "m0", k, k * 15_000_000)
        errors.append(pose_error(seen.camera_from_marker, scene.pose))
    assert np.sqrt(np.mean(np.square(errors), axis=0))[0] < 0.05


def test_light_that_changes_while_tracking_is_followed():
    detector = make_detector("refined", "r0", "m0", MARKER, INFO)

    def gains(t_s):
        return (1.0 - 0.5 * t_s, 1.0, 1.0 - 0.3 * np.sin(8 * t_s))

    errors = [pose_error(seen.camera_from_marker, scene.pose)[0] for scene, seen in _run(detector, 40, gains=gains)]
    assert max(errors) < 0.05


def test_tracking_gives_what_a_first_sight_gives():
    tracking = make_detector("refined", "r0", "m0", MARKER, INFO)
    for k, (scene, seen) in enumerate(_run(tracking, 10)):
        if k % 3 == 0:
            first = make_detector("refined", "r0", "m0", MARKER, INFO).detect(render(scene, INFO, samples=3))
            assert pose_error(seen.camera_from_marker, first.camera_from_marker)[0] < 0.02


def test_a_lost_marker_is_found_again_where_it_comes_back():
    detector = make_detector("refined", "r0", "m0", MARKER, INFO)
    here, there = Scene(_swing(0.0)), Scene(facing_pose(0.5, 4.0, 2.0, [-0.025, 0.02, 0.17]))
    away = Scene(facing_pose(0.0, 0.0, 0.0, [0.4, 0.0, 0.18]))
    assert detector.detect(render(here, INFO, t_ns=0)).status is MarkerStatus.OK
    assert detector.detect(render(away, INFO, t_ns=15_000_000, samples=1)).status is MarkerStatus.NOT_FOUND
    seen = detector.detect(render(there, INFO, t_ns=30_000_000))
    assert seen.status is MarkerStatus.OK
    assert pose_error(seen.camera_from_marker, there.pose)[0] < 0.05


def test_a_marker_that_jumps_between_frames_is_found_in_the_same_frame():
    info = sr300_camera()
    detector = make_detector("refined", "r0", "m0", MARKER, info)
    for k, shift_m in enumerate((0.0, 0.03, -0.02)):
        scene = Scene(facing_pose(0.3, 1.0, 0.5 * k, [shift_m, 0.0, 0.25]))
        seen = detector.detect(render(scene, info, t_ns=k * 16_000_000, samples=3))
        assert seen.status is MarkerStatus.OK
        assert pose_error(seen.camera_from_marker, scene.pose)[0] < 0.05


def test_reset_forgets():
    scene = Scene(_swing(0.1))
    fresh = make_detector("refined", "r0", "m0", MARKER, INFO)
    first = fresh.detect(render(scene, INFO))
    used = make_detector("refined", "r0", "m0", MARKER, INFO)
    for _ in _run(used, 3, gains=lambda t_s: (0.8, 1.0, 1.2)):
        pass
    used.reset()
    again = used.detect(render(scene, INFO))
    np.testing.assert_array_equal(again.camera_from_marker, first.camera_from_marker)
    np.testing.assert_array_equal(again.covariance, first.covariance)


def test_time_running_backwards_starts_anew():
    detector = make_detector("refined", "r0", "m0", MARKER, INFO)
    for _ in _run(detector, 4):
        pass
    scene = Scene(facing_pose(0.4, 2.0, 1.0, [0.01, 0.01, 0.17]))
    seen = detector.detect(render(scene, INFO, t_ns=0))
    assert pose_error(seen.camera_from_marker, scene.pose)[0] < 0.05


def _noisy_centers(pose, sigma_px, rng):
    H = pose[:3, [0, 1, 3]]
    rays = np.array([ellipse(H, x, y, LAYOUT.radius_m)[:2] for x, y in LAYOUT.centers_m.tolist()])
    sigma = sigma_px / 154.5
    return Centers(LAYOUT.centers_m, rays + rng.normal(0, sigma, (4, 2)), np.full(4, sigma), LAYOUT.radius_m)


def test_two_poses_that_explain_the_image_alike_are_called_ambiguous():
    solver = Solver(LAYOUT, Optics(INFO.color))
    pose = facing_pose(0.3, 1.0, 0.2, [0.0, 0.0, 0.5])
    centers = _noisy_centers(pose, 0.25, np.random.default_rng(61))
    starts = poses_of_homography(homography(centers.plate_m, centers.rays))
    assert solver.cold(centers, None, starts).status is MarkerStatus.AMBIGUOUS


def test_the_ambiguity_is_resolved_by_the_pose_before():
    solver = Solver(LAYOUT, Optics(INFO.color))
    pose = facing_pose(0.3, 1.0, 0.2, [0.0, 0.0, 0.5])
    for seed in range(10):
        centers = _noisy_centers(pose, 0.1, np.random.default_rng(seed))
        near = exp_so3(np.array([0.02, -0.02, 0.01])) @ pose[:3, :3]
        solution = solver.track(centers, None, (near, pose[:3, 3]))
        assert solution.status is MarkerStatus.COLOR_ONLY
        assert pose_error(transform(solution.fit.R, solution.fit.p_m), pose)[0] < 12.0


def test_a_wrong_branch_is_left_as_soon_as_the_image_tells():
    solver = Solver(LAYOUT, Optics(INFO.color))
    pose = facing_pose(0.4, 1.0, 0.2, [0.01, 0.0, 0.18])
    centers = _noisy_centers(pose, 0.02, np.random.default_rng(62))
    solution = solver.track(centers, None, (mirrored(pose[:3, :3], pose[:3, 3]), pose[:3, 3]))
    assert pose_error(transform(solution.fit.R, solution.fit.p_m), pose)[0] < 0.5


@pytest.mark.parametrize(
    ("distance_m", "status"),
    [(0.02, MarkerStatus.OUT_OF_RANGE), (0.5, MarkerStatus.COLOR_ONLY), (2.5, MarkerStatus.OUT_OF_RANGE)],
)
def test_poses_that_no_sensor_can_see_are_out_of_range(distance_m, status):
    solver = Solver(LAYOUT, Optics(INFO.color))
    pose = facing_pose(0.3, 1.0, 0.2, [0.0, 0.0, distance_m])
    solution = solver.track(_noisy_centers(pose, 0.01, np.random.default_rng(63)), None, (pose[:3, :3], pose[:3, 3]))
    assert solution.status is status
    assert (solution.fit is not None) == (status is MarkerStatus.COLOR_ONLY)
