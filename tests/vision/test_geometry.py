"""The parts of the refined method against brute force."""

import cv2
import numpy as np
import pytest

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3
from ghest_rt.vision.ellipses import ellipse, marker_image
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.motion import MotionTrack
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.planar_pose import facing_homography, homography, mirrored, pose_on_plane, poses_of_homography
from ghest_rt.vision.plate_plane import Plane, PlateDepth
from ghest_rt.vision.pose_fit import Centers, fit_pose
from tests.vision.scenes import (
    MARKER,
    Scene,
    facing_pose,
    paper_camera,
    pinhole,
    pose_error,
    random_pose,
    render_depth,
    sr300_camera,
)

LAYOUT = MarkerLayout.of(MARKER)
PLACES = LAYOUT.centers_m.tolist()
CURVED = pinhole(640, 480, 475.0, (-0.15, 0.06, 0.002, -0.001, 0.01))


def _plate_to_rays(pose):
    return pose[:3, [0, 1, 3]]


def _spot(center_m, radius_m, pose, optics):
    """Pixels of a fine grid of equal areas *of the image* inside a disk: weights make up for perspective."""
    line = np.linspace(-1, 1, 401)
    q = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    q = q[(q**2).sum(axis=1) <= 1]
    h = 1e-6

    def image(plate):
        points = np.column_stack([plate, np.ones(len(plate))]) @ _plate_to_rays(pose).T
        return optics.pixels(points[:, :2] / points[:, 2:])

    plate = np.asarray(center_m) + radius_m * q
    du, dv = (image(plate + np.array(d) * h) - image(plate - np.array(d) * h) for d in ((1, 0), (0, 1)))
    weight = np.abs(du[:, 0] * dv[:, 1] - du[:, 1] * dv[:, 0])
    return image(plate), weight / weight.sum()


def test_the_ellipse_has_the_centroid_and_spread_of_the_disk_s_image():
    pose = facing_pose(0.9, 0.7, 0.4, [0.02, -0.01, 0.15])
    optics = Optics(paper_camera().color)
    seen = marker_image(_plate_to_rays(pose), PLACES, LAYOUT.radius_m, optics)
    for place, disk in zip(PLACES, seen.disks, strict=True):
        pixels, weight = _spot(place, LAYOUT.radius_m, pose, optics)
        centroid = weight @ pixels
        np.testing.assert_allclose((disk.u, disk.v), centroid, atol=4e-3)
        spread = 4 * ((pixels - centroid) * weight[:, None]).T @ (pixels - centroid)
        np.testing.assert_allclose([[disk.a, disk.b], [disk.b, disk.c]], spread, rtol=5e-3, atol=5e-2)


def test_the_perspective_bias_is_not_small():
    pose = facing_pose(0.9, 0.7, 0.4, [0.02, -0.01, 0.15])
    x, y, *_ = ellipse(_plate_to_rays(pose), *PLACES[0], LAYOUT.radius_m)
    center = pose[:3, :3] @ [*PLACES[0], 0.0] + pose[:3, 3]
    assert 154.5 * np.hypot(x - center[0] / center[2], y - center[1] / center[2]) > 0.05


def test_a_disk_behind_the_camera_has_no_image():
    assert ellipse(_plate_to_rays(facing_pose(0.0, 0.0, 0.0, [0.0, 0.0, -0.1])), 0.0, 0.0, 0.01) is None


def test_lens_distortion_places_points_as_opencv_does():
    rays = np.random.default_rng(1).uniform(-0.45, 0.45, (20, 2))
    wanted, _ = cv2.projectPoints(
        np.column_stack([rays, np.ones(20)]), np.zeros(3), np.zeros(3), CURVED.matrix, np.array(CURVED.distortion)
    )
    optics = Optics(CURVED)
    np.testing.assert_allclose(optics.pixels(rays), wanted[:, 0], atol=1e-9)
    for (x, y), pixel in zip(rays, wanted[:, 0], strict=True):
        u, v, *slopes = optics.place(x, y)
        np.testing.assert_allclose((u, v), pixel, atol=1e-9)
        h = 1e-6
        around = optics.pixels(np.array([[x + h, y], [x - h, y], [x, y + h], [x, y - h]]))
        dx, dy = (around[0] - around[1]) / (2 * h), (around[2] - around[3]) / (2 * h)
        np.testing.assert_allclose(slopes, [dx[0], dy[0], dx[1], dy[1]], rtol=1e-5, atol=1e-3)


def test_the_centroid_of_a_spot_under_distortion_is_led_back_to_the_undistorted_one():
    optics = Optics(CURVED)
    pose = facing_pose(0.3, 0.5, 0.0, [0.10, 0.075, 0.26])
    x, y, *_ = ellipse(_plate_to_rays(pose), *PLACES[3], LAYOUT.radius_m)
    pixels, weight = _spot(PLACES[3], LAYOUT.radius_m, pose, optics)
    disk = marker_image(_plate_to_rays(pose), PLACES, LAYOUT.radius_m, optics).disks[3]
    radius2 = np.array([[np.sqrt(disk.determinant)]])
    corrected = optics.disk_rays((weight @ pixels)[None], radius2)[0]
    plain = optics.disk_rays((weight @ pixels)[None], np.zeros((1, 1)))[0]
    assert 475 * np.linalg.norm(plain - (x, y)) > 0.05  # pixels
    assert 475 * np.linalg.norm(corrected - (x, y)) < 0.01


@pytest.mark.parametrize("tilt_rad", [0.0, 0.05, 0.6, 1.1])
def test_one_of_the_two_poses_of_a_homography_is_the_true_one(tilt_rad):
    pose = facing_pose(tilt_rad, 2.0, 0.7, [0.02, 0.01, 0.2])
    H = homography(LAYOUT.centers_m, _rays(pose))
    errors = [pose_error(transform(*found), pose) for found in poses_of_homography(H)]
    assert min(errors)[0] < 1e-2  # degrees; the homography is found in single precision
    assert min(errors)[1] < 0.05


def test_the_mirrored_pose_looks_alike_from_afar_and_mirrors_back():
    pose = facing_pose(0.5, 1.0, 0.2, [0.3, -0.2, 4.0])
    other = transform(mirrored(pose[:3, :3], pose[:3, 3]), pose[:3, 3])
    assert np.linalg.det(other[:3, :3]) == pytest.approx(1.0)
    assert pose_error(other, pose)[0] > 30.0
    assert np.abs(_rays(other) - _rays(pose)).max() < 2e-4 * 0.3
    np.testing.assert_allclose(mirrored(other[:3, :3], other[:3, 3]), pose[:3, :3], atol=1e-12)


def test_two_points_on_a_known_plane_give_the_pose():
    pose = random_pose(np.random.default_rng(8))
    n = pose[:3, 2]
    theta = n / (n @ pose[:3, 3])
    np.testing.assert_allclose(pose_on_plane(theta, LAYOUT.centers_m[[0, 3]], _rays(pose, [0, 3])), pose, atol=1e-12)
    assert pose_on_plane(1.3 * theta, LAYOUT.centers_m[[0, 3]], _rays(pose, [0, 3])) is None


def test_the_facing_homography_passes_through_its_points_with_the_front_to_the_camera():
    pose = facing_pose(0.0, 0.0, 0.6, [0.02, 0.01, 0.2])
    H = facing_homography(LAYOUT.centers_m[[1, 2]], _rays(pose, [1, 2]))
    np.testing.assert_allclose(H / H[2, 2], _plate_to_rays(pose) / pose[2, 3], atol=1e-12)


def _rays(pose, which=(0, 1, 2, 3)):
    points = LAYOUT.centers_m[list(which)] @ pose[:3, :2].T + pose[:3, 3]
    return points[:, :2] / points[:, 2:]


def _centers(pose, sigma):
    rays = np.array([ellipse(_plate_to_rays(pose), x, y, LAYOUT.radius_m)[:2] for x, y in PLACES])
    return Centers(LAYOUT.centers_m, rays, np.full(4, sigma), LAYOUT.radius_m)


def _plane(pose, sigma):
    theta = pose[:3, 2] / (pose[:3, 2] @ pose[:3, 3])
    return Plane(theta, np.eye(3) * sigma**2, 1.0)


@pytest.mark.parametrize("with_plane", [True, False])
def test_the_fit_returns_the_pose_it_was_made_from(with_plane):
    pose = random_pose(np.random.default_rng(31))
    start = exp_so3(np.array([0.03, -0.04, 0.05])) @ pose[:3, :3]
    plane = _plane(pose, 1e-3) if with_plane else None
    fit = fit_pose(start, pose[:3, 3] + 0.002, _centers(pose, 1e-5), plane, 8)
    rotation_deg, position_mm = pose_error(transform(fit.R, fit.p_m), pose)
    assert rotation_deg < 1e-4
    assert position_mm < 1e-4
    assert fit.chi2 < 1e-3


def test_the_fit_s_covariance_is_that_of_its_error():
    rng = np.random.default_rng(32)
    pose = random_pose(rng)
    sigma, plane_sigma = 1e-4, 5e-3
    exact, plane = _centers(pose, sigma), _plane(pose, plane_sigma)
    nees = []
    for _ in range(200):
        noisy = Centers(exact.plate_m, exact.rays + rng.normal(0, sigma, (4, 2)), exact.sigma, exact.radius_m)
        tilted = Plane(plane.theta + rng.normal(0, plane_sigma, 3), plane.covariance, 1.0)
        fit = fit_pose(pose[:3, :3], pose[:3, 3], noisy, tilted, 8)
        turn = fit.R @ pose[:3, :3].T
        error = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
        error = np.concatenate([error, fit.p_m - pose[:3, 3]])
        nees.append(error @ fit.information @ error)
    assert np.mean(nees) == pytest.approx(6.0, abs=0.75)  # 4 standard deviations of the mean of 200


def test_a_plane_seen_from_another_frame_holds_the_same_points():
    rng = np.random.default_rng(33)
    here_from_there = random_pose(rng)
    points_there = np.column_stack([rng.uniform(-0.1, 0.1, (2, 5)).T, np.full(5, 0.2)])
    points_here = points_there @ here_from_there[:3, :3].T + here_from_there[:3, 3]
    theta = np.linalg.lstsq(points_here, np.ones(5), rcond=None)[0]
    moved = Plane(theta, np.eye(3), 1.0).seen_from(here_from_there)
    np.testing.assert_allclose(points_there @ moved.theta, 1.0, atol=1e-9)


def test_the_plane_of_the_plate_survives_holes_and_something_lying_on_it():
    info = sr300_camera()
    rng = np.random.default_rng(34)
    scene = Scene(facing_pose(0.5, 1.0, 0.2, [0.01, 0.0, 0.25]), depth_noise_m=0.0005)
    depth = render_depth(scene, info, rng)
    from_color = np.linalg.inv(info.color_from_depth)
    pose = from_color @ scene.pose
    v, u = (int(x) for x in np.rint(475 * pose[1::-1, 3] / pose[2, 3] + (239.5, 319.5)))
    depth[v - 10 : v + 12, u - 40 : u] = 0
    depth[v : v + 25, u : u + 30] -= 160  # 20 mm nearer
    guess = from_color @ facing_pose(0.48, 1.0, 0.2, [0.01, 0.0005, 0.251])
    plane = PlateDepth(LAYOUT, info).fit(depth, guess, (0.004,))
    truth = pose[:3, 2] / (pose[:3, 2] @ pose[:3, 3])
    error = plane.theta - truth
    assert error @ np.linalg.solve(plane.covariance, error) < 16.3  # 99.9 % of chi-squared with three degrees of freedom
    assert plane.share < 0.95


def test_no_plane_where_depth_is_empty_or_the_plate_out_of_view():
    info = sr300_camera()
    fitter = PlateDepth(LAYOUT, info)
    facing = facing_pose(0.0, 0.0, 0.0, [0.0, 0.0, 0.25])
    assert fitter.fit(np.zeros((480, 640), dtype=np.uint16), facing, (0.004,)) is None
    assert (
        fitter.fit(np.full((480, 640), 2000, dtype=np.uint16), facing_pose(0.0, 0.0, 0.0, [1.0, 0.0, 0.25]), (0.004,)) is None
    )
    assert (
        fitter.fit(np.full((480, 640), 2000, dtype=np.uint16), facing_pose(0.0, 0.0, 0.0, [0.0, 0.0, -0.25]), (0.004,)) is None
    )
    assert (
        fitter.fit(np.full((480, 640), 2000, dtype=np.uint16), facing_pose(np.pi / 2, 0.0, 0.0, [0.0, 0.0, 0.25]), (0.004,))
        is None
    )


def test_motion_goes_on_for_a_short_while_and_is_forgotten_after_a_long_one():
    track = MotionTrack()
    assert track.predict(0) is None
    spin, speed = np.array([0.0, 0.8, -0.4]), np.array([0.05, 0.0, 0.02])
    start = facing_pose(0.2, 0.3, 0.1, [0.0, 0.0, 0.2])

    def pose_at(t_s):
        return transform(exp_so3(t_s * spin) @ start[:3, :3], start[:3, 3] + t_s * speed)

    for k in range(5):
        track.update(k * 15_000_000, pose_at(k * 0.015))
    np.testing.assert_allclose(track.predict(75_000_000), pose_at(0.075), atol=1e-9)
    assert track.predict(2_000_000_000) is None
    assert track.predict(0) is None  # time ran backwards: another recording
    track.reset()
    assert track.predict(75_000_000) is None
