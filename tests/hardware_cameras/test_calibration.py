"""Lens models against the SDK's own projection, registration against the SDK's own alignment."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

pytest.importorskip("pyrealsense2", reason="needs the extra realsense", exc_type=ImportError)

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import BadDeviceData
from ghest_drivers.hardware.cameras.distortion import image_grid
from ghest_drivers.hardware.cameras.registration import DepthRegistration, registered_info
from ghest_drivers.hardware.realsense.calibration import intrinsics_from_sdk, transform_from_sdk
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.software import write_bag
from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame


def sdk_intrinsics(model: Any, coefficients: list[float]) -> Any:
    raw = rs.intrinsics()
    raw.width, raw.height, raw.fx, raw.fy, raw.ppx, raw.ppy = 640, 480, 475.0, 473.0, 318.5, 243.25
    raw.model, raw.coeffs = model, coefficients
    return raw


# Of the size that devices of the family report.
_COLOR_MODELS = [
    (rs.distortion.none, [0.0] * 5),
    (rs.distortion.brown_conrady, [0.12, -0.2, 0.001, -0.0015, 0.07]),
    (rs.distortion.modified_brown_conrady, [0.1, -0.15, 0.001, -0.001, 0.05]),
    (rs.distortion.inverse_brown_conrady, [-0.055, 0.066, 0.0005, -0.0003, -0.021]),
]
_SR300_DEPTH = [0.129, 0.073, 0.0044, 0.0051, 0.0249]


@pytest.mark.parametrize(("model", "coefficients"), _COLOR_MODELS)
def test_opencv_projects_into_the_colour_image_as_the_sdk_does(model: Any, coefficients: list[float]) -> None:
    raw = sdk_intrinsics(model, coefficients)
    ours = intrinsics_from_sdk(raw, is_depth=False)
    points = np.column_stack([(image_grid(640, 480, 17, 13) - (318.5, 243.25)) / 475.0, np.ones(17 * 13)])
    theirs = np.array([rs.rs2_project_point_to_pixel(raw, point) for point in points.tolist()])
    projected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), ours.matrix, np.array(ours.distortion))
    assert np.abs(projected.reshape(-1, 2) - theirs).max() < 0.05


def test_an_sr300s_depth_polynomial_undistorts() -> None:
    ours = intrinsics_from_sdk(sdk_intrinsics(rs.distortion.inverse_brown_conrady, _SR300_DEPTH), is_depth=True)
    pixels = image_grid(640, 480, 17, 13)
    x, y = ((pixels - (318.5, 243.25)) / (475.0, 473.0)).T
    k1, k2, p1, p2, k3 = _SR300_DEPTH
    r2 = x**2 + y**2
    f = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    ideal = np.column_stack(
        [x * f + 2 * p1 * x * y + p2 * (r2 + 2 * x**2), y * f + 2 * p2 * x * y + p1 * (r2 + 2 * y**2), np.ones(len(x))]
    )
    seen, _ = cv2.projectPoints(ideal, np.zeros(3), np.zeros(3), ours.matrix, np.array(ours.distortion))
    error_px = np.hypot(*(seen.reshape(-1, 2) - pixels).T)
    from_middle_px = np.hypot(*(pixels - (319.5, 239.5)).T)
    assert error_px[from_middle_px < 320].max() < 0.4
    assert error_px.max() < 2.5  # in the corners, where the polynomial moves pixels by 60


@pytest.mark.parametrize("model", [rs.distortion.kannala_brandt4, rs.distortion.ftheta])
def test_fisheye_models_are_refused_by_name(model: Any) -> None:
    with pytest.raises(BadDeviceData, match=model.name):
        intrinsics_from_sdk(sdk_intrinsics(model, [0.1, 0.0, 0.0, 0.0, 0.0]), is_depth=False)


@pytest.mark.parametrize("is_depth", [True, False])
def test_a_lens_that_no_plumb_bob_model_matches_is_refused(is_depth: bool) -> None:
    with pytest.raises(BadDeviceData, match="matched only to"):
        intrinsics_from_sdk(
            sdk_intrinsics(rs.distortion.inverse_brown_conrady, [-1.5, 3.0, 0.15, 0.15, 2.0]), is_depth=is_depth
        )


def test_an_impossible_focal_length_is_refused() -> None:
    raw = sdk_intrinsics(rs.distortion.none, [0.0] * 5)
    raw.fx = 0.0
    with pytest.raises(BadDeviceData, match="impossible intrinsics"):
        intrinsics_from_sdk(raw, is_depth=False)


def test_extrinsics_carry_points_as_the_sdk_does() -> None:
    R, _ = cv2.Rodrigues(np.array([0.1, -0.4, 0.7]))
    raw = rs.extrinsics()
    raw.rotation = R.T.ravel().tolist()
    raw.translation = [0.025, -0.001, 0.003]
    point = [0.1, 0.2, 0.3]
    ours = transform_from_sdk(raw) @ [*point, 1.0]
    np.testing.assert_allclose(ours[:3], rs.rs2_transform_point_to_point(raw, point), atol=1e-6)


def test_extrinsics_that_are_not_rigid_are_refused() -> None:
    raw = rs.extrinsics()
    raw.rotation = [1.0, 0.0, 0.0, 0.0, 1.1, 0.0, 0.0, 0.0, 1.0]
    with pytest.raises(BadDeviceData, match="not rigid"):
        transform_from_sdk(raw)


_T = np.eye(4)
_T[:3, :3] = cv2.Rodrigues(np.array([0.01, -0.02, 0.015]))[0]
_T[:3, 3] = (0.026, 0.001, 0.004)
_CAMERA = CameraInfo(
    "r0", "SR300", "S1", Intrinsics(160, 120, 155, 154, 79, 61), Intrinsics(160, 120, 119, 119, 80, 58), 0.000125, _T, 60.0
)


def _scene() -> Any:
    """A slanted plane with a box before it and a hole."""
    u, v = np.meshgrid(np.arange(160), np.arange(120))
    counts = (3200 + 4 * u - 3 * v).astype(np.uint16)
    counts[40:80, 60:100] = 2000
    counts[5:15, 5:30] = 0
    return counts


def test_registration_agrees_with_the_sdks_alignment(tmp_path: Path) -> None:
    path = tmp_path / "scene.bag"
    color = np.zeros((120, 160, 3), np.uint8)
    times = [10**9 + k * 16_666_667 for k in range(20)]
    write_bag(
        path, _CAMERA, [RgbdFrame(_CAMERA, k, color, _scene(), t, t, t, t) for k, t in enumerate(times)], MonotonicClock()
    )
    config, pipeline = rs.config(), rs.pipeline()
    rs.config.enable_device_from_file(config, str(path), repeat_playback=False)
    pipeline.start(config)
    frames = rs.align(rs.stream.color).process(pipeline.wait_for_frames())
    theirs = np.array(frames.get_depth_frame().get_data()).astype(int)
    pipeline.stop()
    ours = DepthRegistration(_CAMERA).apply(_scene()).astype(int)
    both = (ours > 0) & (theirs > 0)
    assert both.sum() > 10_000
    assert ((ours > 0) != (theirs > 0)).mean() < 0.01  # outlines, by a pixel
    # The SDK writes the depth camera's z; ours is along the colour camera's own axis, which is what its pixels mean: the
    # offset along z is 0.004 m = 32 counts, the slant of the axes adds up to as much.
    difference = np.abs(ours - theirs)[both]
    assert 20 < np.median(difference) < 45
    assert np.quantile(difference, 0.98) < 90


def test_registered_depth_lies_where_the_colour_camera_sees_it() -> None:
    points = np.array([[0.01, 0.02, 0.30], [-0.03, 0.01, 0.25]])
    depth_px = [p[:2] / p[2] * (119, 119) + (80, 58) for p in points]
    counts = np.zeros((120, 160), np.uint16)
    for point, pixel in zip(points, depth_px, strict=True):
        counts[round(pixel[1]), round(pixel[0])] = round(point[2] / 0.000125)
    out = DepthRegistration(_CAMERA).apply(counts)
    for point in points:
        x, y, z = _T[:3, :3] @ point + _T[:3, 3]
        u, v = round(155 * x / z + 79), round(154 * y / z + 61)
        near = out[v - 2 : v + 3, u - 2 : u + 3]
        assert abs(near.max() * 0.000125 - z) < 0.001
    assert registered_info(_CAMERA).depth == _CAMERA.color


def test_nothing_measured_registers_to_nothing() -> None:
    assert not DepthRegistration(_CAMERA).apply(np.zeros((120, 160), np.uint16)).any()
