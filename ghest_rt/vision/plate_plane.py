"""The plate's plane from the depth image.

In the frame of the depth camera the plane is theta . X = 1, so that along the ray (x, y, 1) the inverse depth is
1/z = theta . (x, y, 1): linear in the ray, and with a noise that the fit of 1/z weighs evenly over the plate.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import CameraInfo
from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.registration import ray_grid
from ghest_rt.vision.small import inverse_of

_MIN_PIXELS = 40
_MIN_SHARE = 0.3  # of the plate's pixels that must be measured and lie on the plane
_SIGMAS = 4.0
_FEW = 2e-3  # share of pixels beyond the gate for which another fit is not worth its time
_MORE_FITS = 2
_ROUNDING = 0.29  # standard deviation of a rounding error
_FLOOR_COUNTS = 1.5  # no pixel is an outlier for being this near
_MAX_SAMPLES = 3600
_MIXED_PX = 1.2  # pixels along the plate's edge that may see past it
_SHIFT_BITS = 4
_NOWHERE = 1e9  # 1/m
_GRAZING = 0.05  # sine of the least angle between plate and line of sight

Float32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Plane:
    """The plane theta . X = 1.

    Attributes:
        theta: (3,) in 1/m: unit normal over distance.
        covariance: (3, 3) of theta.
        share: Share of the plate's pixels that lie on the plane.
    """

    theta: Array
    covariance: Array
    share: float

    def seen_from(self, here_from_there: Array) -> "Plane":
        """Return the plane in another frame: X_here = T X_there turns theta into R^T theta / (1 - theta . t)."""
        R, t = here_from_there[:3, :3], here_from_there[:3, 3]
        scale = 1.0 / (1.0 - float(self.theta @ t))
        theta = (self.theta @ R) * scale
        J = R.T * scale + np.outer(theta * scale, t)
        return Plane(theta, J @ self.covariance @ J.T, self.share)


class PlateDepth:
    """Fits the plane to the depth pixels that a predicted pose puts on the plate."""

    def __init__(self, layout: MarkerLayout, info: CameraInfo) -> None:
        self._optics = Optics(info.depth)
        self._unit_m = info.depth_unit_m
        self._half_m = layout.half_plate_m
        self._corners = np.sign(layout.corners_m)
        rays = ray_grid(info.depth)
        self._basis = np.stack([rays[..., 0], rays[..., 1], np.ones(rays.shape[:2])]).astype(np.float32)
        # Of every count the inverse depth, quicker looked up than divided; of what was not measured one beyond any gate.
        counts = np.arange(1, 1 << 16)
        self._inverse_depth = np.concatenate([[_NOWHERE], 1.0 / (self._unit_m * counts)]).astype(np.float32)

    def fit(self, depth_counts: NDArray[np.uint16], depth_from_marker: Array, gates_m: tuple[float, ...]) -> Plane | None:
        """Return the plane in the depth camera's frame, or None if too little of the plate was measured.

        Args:
            depth_counts: (h, w) depth image, 0 where not measured.
            depth_from_marker: (4, 4) predicted pose of the marker in the depth camera.
            gates_m: Distances from the plane so far, the first from the predicted one, beyond which a pixel is no part of the
                plate; a last gate by the scatter found follows.
        """
        region = self._region(depth_from_marker)
        if region is None:
            return None
        rows, columns, mask = region
        basis = self._basis[:, rows, columns].reshape(3, -1)
        inverse = self._inverse_depth.take(depth_counts[rows, columns]).ravel()
        wanted = max(int(np.count_nonzero(mask)), 1)

        n, p_m = depth_from_marker[:3, 2], depth_from_marker[:3, 3]
        distance_m, depth_m = float(n @ p_m), float(p_m[2])
        if abs(distance_m) < _GRAZING * depth_m:
            return None
        slope = 1.0 / (depth_m * depth_m)  # inverse metres per metre of depth
        theta = n / distance_m
        residual = inverse - theta.astype(np.float32) @ basis
        least = max(_MIN_PIXELS, round(_MIN_SHARE * wanted))
        floor = _FLOOR_COUNTS * self._unit_m * slope
        fitted = _fit_correction(basis, residual, mask, [gate_m * slope for gate_m in gates_m], floor, least=least)
        if fitted is None:
            return None
        covariance = fitted.inverse_normal * max(fitted.variance, (_ROUNDING * self._unit_m * slope) ** 2)
        return Plane(theta + fitted.change, covariance, fitted.count / wanted)

    def _region(self, pose: Array) -> tuple[slice, slice, NDArray[np.bool_]] | None:
        """Return the rows and columns (strided) that hold the plate, and which of their pixels lie well on it."""
        distance_m = float(pose[2, 3])
        if distance_m <= 0.0:
            return None
        pixel_m = distance_m / self._optics.mean_focal_px
        inner_m = self._half_m - min(_MIXED_PX * pixel_m + 0.02 * self._half_m, 0.4 * self._half_m)
        corners_px = []
        for x, y, z in ((inner_m * self._corners) @ pose[:3, :2].T + pose[:3, 3]).tolist():
            if z <= 0.2 * distance_m:
                return None
            corners_px.append(self._optics.place(x / z, y / z)[:2])
        columns, rows = zip(*corners_px, strict=True)
        left, right = max(math.ceil(min(columns)), 0), min(math.floor(max(columns)) + 1, self._optics.width_px)
        top, bottom = max(math.ceil(min(rows)), 0), min(math.floor(max(rows)) + 1, self._optics.height_px)
        width, height = right - left, bottom - top
        if width < 5 or height < 5:
            return None
        step = max(1, round((width * height / _MAX_SAMPLES) ** 0.5))
        mask = np.zeros((-(-height // step), -(-width // step)), dtype=np.uint8)
        scale = (1 << _SHIFT_BITS) / step
        polygon = np.array([(round((u - left) * scale), round((v - top) * scale)) for u, v in corners_px], dtype=np.int32)
        cv2.fillConvexPoly(mask, polygon, 1, lineType=cv2.LINE_8, shift=_SHIFT_BITS)
        return slice(top, bottom, step), slice(left, right, step), mask.view(np.bool_).ravel()


@dataclass(frozen=True, slots=True, eq=False)
class _Correction:
    change: Array  # (3,) to be added to theta
    inverse_normal: Array  # (3, 3)
    variance: float  # of one pixel's inverse depth
    count: int  # pixels that took part


def _fit_correction(
    basis: Float32, residual: Float32, usable: NDArray[np.bool_], gates: list[float], floor: float, *, least: int
) -> _Correction | None:
    """Fit change . (x, y, 1) to the residuals (n,) of usable inverse depths, outliers left out; None if too few pixels stay."""
    change = np.zeros(3)
    for step in range(len(gates) + _MORE_FITS):
        used = (np.abs(residual) < gates[step]) & usable
        count = int(np.count_nonzero(used))
        if count < least:
            return None
        weighted = basis * used
        inverted = inverse_of((weighted @ basis.T).astype(np.float64))
        if inverted is None:
            return None
        inverse_normal = inverted
        more = inverse_normal @ (weighted @ residual).astype(np.float64)
        change += more
        residual = residual - more.astype(np.float32) @ basis
        inner = residual * used
        variance = float(inner @ inner) / (count - 3)
        if step + 1 >= len(gates):
            gates.append(max(_SIGMAS * math.sqrt(variance), floor))
            if np.count_nonzero(np.abs(inner) > gates[-1]) <= _FEW * count:
                break
    return _Correction(change, inverse_normal, variance, count)
