"""Viewing rays of a camera's pixels, and where points fall in its image."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import Intrinsics
from ghest_rt.geometry.so3 import Array

_UNDISTORT_ITERATIONS = 40


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle of pixels, half open.

    Attributes:
        u0: First column.
        v0: First row.
        u1: Column after the last.
        v1: Row after the last.
    """

    u0: int
    v0: int
    u1: int
    v1: int

    @property
    def empty(self) -> bool:
        """Whether it holds no pixel."""
        return self.u1 <= self.u0 or self.v1 <= self.v0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Index into an image."""
        return slice(self.v0, self.v1), slice(self.u0, self.u1)


class PixelRays:
    """Rays (x, y, 1) of all pixels, camera axes, lens distortion included.

    Attributes:
        x: (H, W) x of the ray through each pixel's centre.
        y: (H, W) y.
        step_u: (H, W, 2) change of (x, y) per pixel to the right.
        step_v: (H, W, 2) change of (x, y) per pixel down.
    """

    def __init__(self, intrinsics: Intrinsics) -> None:
        self._k = intrinsics
        # One pixel more on every side, for the differences at the border.
        u = np.arange(-1.0, intrinsics.width_px + 1.0)
        v = np.arange(-1.0, intrinsics.height_px + 1.0)
        x_d, y_d = np.meshgrid((u - intrinsics.cx_px) / intrinsics.fx_px, (v - intrinsics.cy_px) / intrinsics.fy_px)
        x, y = x_d.copy(), y_d.copy()
        if any(intrinsics.distortion):
            for _ in range(_UNDISTORT_ITERATIONS):
                x_now, y_now = _distort(x, y, intrinsics.distortion)
                x += x_d - x_now
                y += y_d - y_now
        self.x: Array = np.ascontiguousarray(x[1:-1, 1:-1])
        self.y: Array = np.ascontiguousarray(y[1:-1, 1:-1])
        self.step_u: Array = np.stack((x[1:-1, 2:] - x[1:-1, :-2], y[1:-1, 2:] - y[1:-1, :-2]), axis=-1) / 2
        self.step_v: Array = np.stack((x[2:, 1:-1] - x[:-2, 1:-1], y[2:, 1:-1] - y[:-2, 1:-1]), axis=-1) / 2

    def project(self, points_m: Array) -> Array:
        """Return the (n, 2) pixel coordinates (u, v) of (n, 3) points in front of the camera, camera axes."""
        x, y = _distort(points_m[:, 0] / points_m[:, 2], points_m[:, 1] / points_m[:, 2], self._k.distortion)
        return np.column_stack((self._k.fx_px * x + self._k.cx_px, self._k.fy_px * y + self._k.cy_px))

    def region_around(self, points_m: Array, margin_px: float) -> Region:
        """Return the pixels around the image of some points, clipped to the image; empty if one is not in front."""
        if points_m[:, 2].min() <= 1e-3:
            return Region(0, 0, 0, 0)
        uv = self.project(points_m)
        (u0, v0), (u1, v1) = np.floor(uv.min(axis=0) - margin_px), np.ceil(uv.max(axis=0) + margin_px)
        width, height = self._k.width_px, self._k.height_px
        if u1 < 0 or v1 < 0 or u0 >= width or v0 >= height:
            return Region(0, 0, 0, 0)
        return Region(max(int(u0), 0), max(int(v0), 0), min(int(u1) + 1, width), min(int(v1) + 1, height))

    def directions(self, rows: slice, columns: slice) -> NDArray[np.float64]:
        """Return (n, 3) rays (x, y, 1) of a block of pixels, row by row."""
        x = self.x[rows, columns]
        rays = np.ones((x.size, 3))
        rays[:, 0] = x.ravel()
        rays[:, 1] = self.y[rows, columns].ravel()
        return rays


def _distort(x: Array, y: Array, d: tuple[float, float, float, float, float]) -> tuple[Array, Array]:
    """Apply the plumb-bob model (OpenCV: k1, k2, p1, p2, k3) to ideal image coordinates."""
    k1, k2, p1, p2, k3 = d
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )
