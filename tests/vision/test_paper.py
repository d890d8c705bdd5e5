"""Method paper: every equation on images made by hand, and the whole on rendered ones."""

import numpy as np
import pytest

from ghest_rt.messages.results import MarkerStatus
from ghest_rt.vision.factory import make_detector
from ghest_rt.vision.paper_disks import blob_center, segment_colors
from ghest_rt.vision.paper_frame import axes_eq5, marker_frame, origin_eq4
from ghest_rt.vision.paper_points import cloud_indices_eq2, depth_pixel_eq1, point_cloud, point_eq3
from ghest_rt.vision.registration import DepthRegistration, is_registered
from tests.vision.scenes import (
    MARKER,
    Blob,
    Scene,
    facing_pose,
    moved,
    paper_camera,
    pose_error,
    random_pose,
    render,
    sr300_camera,
)


def test_step_1a_keeps_only_pixels_near_the_nominal_colour():
    image = np.full((4, 6, 3), 250, dtype=np.uint8)
    image[1, 1] = (214, 40, 57)
    image[1, 2] = (214 - 30, 40 + 30, 57)
    image[2, 4] = (122, 62, 180)
    red, violet = segment_colors(image, np.array([[214.0, 40, 57], [122, 62, 180]]), 35)
    assert {tuple(p) for p in np.argwhere(red)} == {(1, 1), (1, 2)}
    assert {tuple(p) for p in np.argwhere(violet)} == {(2, 4)}


def test_steps_1b_and_1c_take_the_largest_blob_and_the_whole_pixel_middle_of_its_box():
    mask = np.zeros((20, 30), dtype=np.uint8)
    mask[2:4, 2:4] = 255  # a smaller blob
    mask[10:15, 11:18] = 255  # rows 10..14, columns 11..17
    mask[15, 17] = 255  # the box now ends at row 15: between 12 and 13 the lower whole number is taken
    assert blob_center(mask) == (14, 12)


def test_step_1b_finds_no_blob_in_an_empty_or_speckled_mask():
    mask = np.zeros((20, 30), dtype=np.uint8)
    assert blob_center(mask) is None
    mask[::5, ::5] = 255
    assert blob_center(mask) is None


@pytest.mark.parametrize(
    ("pixel", "wanted"), [((0, 0), (0, 0)), ((127, 127), (63, 31)), ((64, 64), (32, 16)), ((100, 3), (50, 1))]
)
def test_eq1_maps_corners_to_corners_and_rounds(pixel, wanted):
    assert depth_pixel_eq1(*pixel, (128, 128), (64, 32)) == wanted


def test_eq2_and_eq3_read_the_point_of_the_pixel_out_of_the_flat_cloud():
    L, N = 7, 5
    depth = np.arange(1, L * N + 1, dtype=np.uint16).reshape(N, L)
    rays = np.stack(np.meshgrid(np.arange(L) / 10, np.arange(N) / 10), axis=-1)
    cloud = point_cloud(depth, 0.001, rays)
    assert cloud.shape == (L * N * 3,)
    assert cloud_indices_eq2(4, 3, L) == (75, 76, 77)
    z_m = depth[3, 4] * 0.001
    np.testing.assert_allclose(point_eq3(cloud, cloud_indices_eq2(4, 3, L)), [0.4 * z_m, 0.3 * z_m, z_m])


def test_eq3_gives_no_point_where_depth_was_not_measured():
    cloud = point_cloud(np.zeros((2, 2), dtype=np.uint16), 0.001, np.zeros((2, 2, 2)))
    assert point_eq3(cloud, (0, 1, 2)) is None


def test_eq4_and_eq5_return_the_frame_that_carries_the_disks():
    pose = random_pose(np.random.default_rng(4))
    disks = np.array([[0.018, -0.018], [-0.018, -0.018], [0.018, 0.018], [-0.018, 0.018]])
    points = disks @ pose[:3, :2].T + pose[:3, 3]
    np.testing.assert_allclose(origin_eq4(points), pose[:3, 3], atol=1e-12)
    np.testing.assert_allclose(marker_frame(points), pose, atol=1e-12)


def test_eq5_normalises_to_a_rotation_when_the_disks_are_off():
    rng = np.random.default_rng(5)
    points = np.array([[0.018, -0.018, 0.2], [-0.018, -0.018, 0.2], [0.018, 0.018, 0.2], [-0.018, 0.018, 0.2]])
    R = axes_eq5(points + rng.normal(0, 0.002, points.shape))
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_eq5_refuses_points_on_a_line():
    assert axes_eq5(np.outer([0.0, 1.0, 2.0, 3.0], [0.01, 0.0, 0.0])) is None


def test_the_paper_camera_gives_errors_of_the_paper_s_size():
    rng = np.random.default_rng(11)
    info = paper_camera()
    detector = make_detector("paper", "r0", "m0", MARKER, info)
    errors = []
    for _ in range(30):
        scene = Scene(random_pose(rng))
        seen = detector.detect(render(scene, info, rng, samples=4))
        assert seen.status is MarkerStatus.OK
        errors.append(pose_error(seen.camera_from_marker, scene.pose))
    rotation_deg, position_mm = np.sqrt(np.mean(np.square(errors), axis=0))
    assert 0.1 < rotation_deg < 1.5
    assert position_mm < 1.2


def test_a_depth_camera_of_its_own_is_registered_first():
    info = sr300_camera()
    assert not is_registered(info)
    scene = Scene(facing_pose(0.4, 1.0, 0.3, [0.01, -0.01, 0.25]))
    seen = make_detector("paper", "r0", "m0", MARKER, info).detect(render(scene, info, samples=2))
    assert seen.status is MarkerStatus.OK
    rotation_deg, position_mm = pose_error(seen.camera_from_marker, scene.pose)
    assert rotation_deg < 1.5
    assert position_mm < 1.0


def test_registered_depth_lies_on_the_surface_that_colour_sees():
    info = sr300_camera()
    scene = Scene(facing_pose(0.3, 0.5, 0.0, [0.0, 0.0, 0.25]))
    depth = DepthRegistration(info)(render(scene, info, samples=1).depth_counts)
    n, p = scene.pose[:3, 2], scene.pose[:3, 3]
    for u, v in ((320, 240), (300, 225), (350, 260)):
        ray = np.array([(u - info.color.cx_px) / 475.0, (v - info.color.cy_px) / 475.0, 1.0])
        assert depth[v, u] * info.depth_unit_m == pytest.approx((n @ p) / (n @ ray), abs=0.6e-3)


def test_registered_depth_never_shows_a_surface_through_the_one_in_front():
    info = sr300_camera()
    for pose in ((0.176, 5.995, 3.139, [0.003, 0.012, 0.217]), (0.12, 2.654, 0.178, [0.004, 0.004, 0.205])):
        scene = Scene(facing_pose(*pose))
        depth = DepthRegistration(info)(render(scene, info, samples=1).depth_counts)
        assert np.count_nonzero(depth > 0.3 / info.depth_unit_m) > 1000, "there is something behind"
        square = MARKER.half_spacing_m * np.stack(np.meshgrid(*2 * [np.linspace(-1.0, 1.0, 80)]), axis=-1).reshape(-1, 2)
        x, y, z = (square @ scene.pose[:3, :2].T + scene.pose[:3, 3]).T
        u = np.rint(info.color.fx_px * x / z + info.color.cx_px).astype(int)
        v = np.rint(info.color.fy_px * y / z + info.color.cy_px).astype(int)
        assert depth[v, u].max() * info.depth_unit_m < z.max() + 0.005


def test_reduced_depth_of_the_same_view_counts_as_registered():
    info = paper_camera()
    color, half = info.color, 0.5
    depth = type(color)(
        64, 64, color.fx_px / 2, color.fy_px / 2, (color.cx_px + half) / 2 - half, (color.cy_px + half) / 2 - half
    )
    assert is_registered(type(info)("r0", "", "", color, depth, 1e-5, np.eye(4), 60.0))


def test_a_hidden_disk_or_missing_depth_gives_a_reason_and_no_pose():
    info = paper_camera()
    scene = Scene(facing_pose(0.0, 0.0, 0.0, [0.0, 0.0, 0.18]))
    detector = make_detector("paper", "r0", "m0", MARKER, info)
    covered = moved(scene, blobs=(Blob((0.016, 0.016, 0.16), 0.012, (60.0, 60.0, 60.0)),))
    for frame in (render(covered, info, samples=2), render(scene, info, samples=2, with_depth=False)):
        seen = detector.detect(frame)
        assert seen.status is MarkerStatus.TOO_FEW_DISKS
        assert seen.camera_from_marker is None
    blank = render(moved(scene, gains=(0.0, 0.0, 0.0)), info, samples=1)
    assert detector.detect(blank).status is MarkerStatus.NOT_FOUND
