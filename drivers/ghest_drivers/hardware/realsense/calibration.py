"""Intrinsics, lens model and extrinsics as the device states them, in ghest's terms.

Lens models, with (x, y) ideal and (x_d, y_d) distorted points on z = 1 and f(r²) = 1 + k1 r² + k2 r⁴ + k3 r⁶:

- none; Brown-Conrady: OpenCV's plumb-bob model as it is.
- modified Brown-Conrady: the tangential terms are taken at the radially distorted point f(r²)·(x, y).
- inverse Brown-Conrady, of a depth image: the polynomial leads from the distorted to the ideal point. That is what its
  documentation says and what an SR300 keeps (its `Invdistc`); `rs2_deproject_pixel_to_point` of SDK 2.54 reads it the other
  way round (since 2021) and would double an SR300's distortion instead of removing it.
- inverse Brown-Conrady, of a colour image: read as the SDK projects it, like the modified one. The D400 family labels its
  colour lenses so.

All but the first two are fitted by the nearest plumb-bob model. Fisheye models (f-theta, Kannala-Brandt) are refused.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ghest_drivers.errors import BadDeviceData
from ghest_drivers.hardware.cameras.distortion import PlumbBob, Points, fit_plumb_bob, image_grid
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.samples import Intrinsics

_MAX_COLOR_ERROR_PX = 0.25  # anywhere: marker corners are measured to hundredths of a pixel
_MAX_DEPTH_RMS_PX = 0.5  # a ray half a depth pixel off meets the plate 0.3 mm beside it at 0.25 m
_MAX_NON_RIGID = 1e-3


def intrinsics_from_sdk(raw: Any, *, is_depth: bool) -> Intrinsics:
    """Translate `rs.intrinsics`. Both count pixels from the centre of the top left one.

    Args:
        raw: The SDK's intrinsics.
        is_depth: Whether they are a depth image's.

    Raises:
        BadDeviceData: No plumb-bob model describes this lens, or the focal length is not positive.
    """
    if not (raw.fx > 0 and raw.fy > 0 and raw.width > 0 and raw.height > 0):
        raise BadDeviceData(f"the device states impossible intrinsics: {raw}")
    return Intrinsics(
        width_px=int(raw.width),
        height_px=int(raw.height),
        fx_px=float(raw.fx),
        fy_px=float(raw.fy),
        cx_px=float(raw.ppx),
        cy_px=float(raw.ppy),
        distortion=_plumb_bob(raw, is_depth=is_depth),
    )


def _plumb_bob(raw: Any, *, is_depth: bool) -> PlumbBob:
    k1, k2, p1, p2, k3 = coefficients = tuple(float(value) for value in raw.coeffs)
    if raw.model == rs.distortion.none or not any(coefficients):
        return (0.0, 0.0, 0.0, 0.0, 0.0)
    if raw.model == rs.distortion.brown_conrady:
        return (k1, k2, p1, p2, k3)
    grid = (image_grid(raw.width, raw.height) - (raw.ppx, raw.ppy)) / (raw.fx, raw.fy)
    if raw.model not in (rs.distortion.inverse_brown_conrady, rs.distortion.modified_brown_conrady):
        raise BadDeviceData(f"lens model {raw.model.name} has no counterpart: use a camera mode with another lens model")
    if raw.model == rs.distortion.inverse_brown_conrady and is_depth:
        ideal, distorted = _polynomial(grid, (k1, k2, p1, p2, k3), tangential_after_radial=False), grid
    else:
        ideal, distorted = grid, _polynomial(grid, (k1, k2, p1, p2, k3), tangential_after_radial=True)
    fit = fit_plumb_bob(ideal, distorted, max(raw.fx, raw.fy))
    if (fit.rms_error_px > _MAX_DEPTH_RMS_PX) if is_depth else (fit.max_error_px > _MAX_COLOR_ERROR_PX):
        raise BadDeviceData(
            f"lens model {raw.model.name} {coefficients} is matched only to {fit.rms_error_px:.2f} px "
            f"({fit.max_error_px:.2f} px in the corners): calibrate the camera anew or choose a mode with a narrower view"
        )
    return fit.coefficients


def _polynomial(points: Points, coefficients: PlumbBob, *, tangential_after_radial: bool) -> Points:
    k1, k2, p1, p2, k3 = coefficients
    x, y = points[:, 0], points[:, 1]
    r2 = x * x + y * y
    radial = 1.0 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    tx, ty = (x * radial, y * radial) if tangential_after_radial else (x, y)
    return np.column_stack(
        [
            x * radial + 2 * p1 * tx * ty + p2 * (r2 + 2 * tx * tx),
            y * radial + 2 * p2 * tx * ty + p1 * (r2 + 2 * ty * ty),
        ]
    )


def transform_from_sdk(raw: Any) -> NDArray[np.float64]:
    """Translate `rs.extrinsics` from b to a (column-major rotation, metres) to the (4, 4) matrix a_from_b.

    Raises:
        BadDeviceData: It is not a rigid transform.
    """
    R = np.array(raw.rotation, dtype=np.float64).reshape(3, 3).T
    t_m = np.array(raw.translation, dtype=np.float64)
    off = float(np.abs(R.T @ R - np.eye(3)).max())
    if not (off < _MAX_NON_RIGID and np.linalg.det(R) > 0 and np.isfinite(t_m).all()):
        raise BadDeviceData(f"the device states extrinsics that are not rigid (by {off:.2g}): calibrate the camera anew")
    U, _, Vt = np.linalg.svd(R)  # the device keeps them in single precision
    T = np.eye(4)
    T[:3, :3] = U @ Vt
    T[:3, 3] = t_m
    return T
