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
        counts = depth_counts[rows, columns].ravel()
        usable = mask & (counts > 0)
        wanted = max(int(np.count_nonzero(mask)), 1)

        n = depth_from_marker[:3, 2]
        theta = n / float(n @ depth_from_marker[:3, 3])
        slope = 1.0 / float(depth_from_marker[2, 3]) ** 2  # inverse metres per metre of depth
        inverse = np.float32(1.0 / self._unit_m) / np.maximum(counts, 1).astype(np.float32)
        residual = inverse - theta.astype(np.float32) @ basis
        gates = [gate_m * slope for gate_m in gates_m]
        for step in range(len(gates) + _MORE_FITS):
            gate = gates[step] if step < len(gates) else by_scatter
            used = (np.abs(residual) < gate) & usable
            count = int(np.count_nonzero(used))
            if count < max(_MIN_PIXELS, _MIN_SHARE * wanted):
                return None
            weighted = basis * used
            inverse_normal = np.linalg.inv((weighted @ basis.T).astype(np.float64))
            gradient = (weighted @ residual).astype(np.float64)
            change = inverse_normal @ gradient
            theta = theta + change
            residual -= change.astype(np.float32) @ basis
            inner = residual * used
            variance = float(inner @ inner) / (count - 3)
            by_scatter = max(_SIGMAS * math.sqrt(variance), _FLOOR_COUNTS * self._unit_m * slope)
            if step + 1 >= len(gates) and np.count_nonzero(np.abs(inner) > by_scatter) <= _FEW * count:
                break
        variance = max(variance, (_ROUNDING * self._unit_m * slope) ** 2)
        return Plane(theta, inverse_normal * variance, count / wanted)

    def _region(self, pose: Array) -> tuple[slice, slice, NDArray[np.bool_]] | None:
        """Return the rows and columns (strided) that hold the plate, and which of their pixels lie well on it."""
        distance_m = float(pose[2, 3])
        pixel_m = distance_m / self._optics.mean_focal_px
        inner_m = self._half_m - min(_MIXED_PX * pixel_m + 0.02 * self._half_m, 0.4 * self._half_m)
        points_m = (inner_m * self._corners) @ pose[:3, :2].T + pose[:3, 3]
        if points_m[:, 2].min() <= 0.2 * distance_m or distance_m <= 0.0:
            return None
        corners_px = self._optics.pixels(points_m[:, :2] / points_m[:, 2:])
        low = np.maximum(np.ceil(corners_px.min(axis=0)), 0).astype(int)
        high = np.minimum(np.floor(corners_px.max(axis=0)) + 1, (self._optics.width_px, self._optics.height_px)).astype(int)
        width, height = (high - low).tolist()
        if width < 5 or height < 5:
            return None
        step = max(1, round((width * height / _MAX_SAMPLES) ** 0.5))
        mask = np.zeros((-(-height // step), -(-width // step)), dtype=np.uint8)
        polygon = np.rint((corners_px - low) * ((1 << _SHIFT_BITS) / step)).astype(np.int32)
        cv2.fillConvexPoly(mask, polygon, 1, lineType=cv2.LINE_8, shift=_SHIFT_BITS)
        return slice(low[1], high[1], step), slice(low[0], high[0], step), mask.view(np.bool_).ravel()
