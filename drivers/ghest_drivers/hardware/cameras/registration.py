"""Depth image to the colour camera's view: what is called aligning or registering.

Off by default: it costs far more than the vision that follows, and rounds every depth to the nearest colour pixel. It is
for tools that can only use registered images.
"""

import math
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import CameraInfo, Intrinsics

_NONE = np.iinfo(np.uint16).max
_MAX_SIDE_PX = 4


def registered_info(info: CameraInfo) -> CameraInfo:
    """Return the facts about the same camera once its depth is registered."""
    return replace(info, depth=info.color, color_from_depth=np.eye(4))


class DepthRegistration:
    """Carries each depth pixel, as a small rectangle, to the colour image; the nearest surface wins.

    Args:
        info: The camera as it measures: intrinsics of both images and `color_from_depth`.
    """

    def __init__(self, info: CameraInfo) -> None:
        depth, color = info.depth, info.color
        self._color = color
        self._unit_m = np.float32(info.depth_unit_m)
        u, v = np.meshgrid(np.arange(depth.width_px, dtype=np.float64), np.arange(depth.height_px, dtype=np.float64))
        rays = _rays(depth, u, v) @ info.color_from_depth[:3, :3].T
        self._rays = np.ascontiguousarray(rays.T, dtype=np.float32)  # (3, n), in colour axes, z about 1
        self._t_m = info.color_from_depth[:3, 3].astype(np.float32)
        # One depth pixel covers this many colour pixels; rounded up, neighbours leave no gap.
        ratios = (color.fx_px / depth.fx_px, color.fy_px / depth.fy_px)
        self._side_px = tuple(min(max(math.ceil(ratio - 1e-3), 1), _MAX_SIDE_PX) for ratio in ratios)
        self._margin_px = max(self._side_px)

    def apply(self, depth_counts: NDArray[np.uint16]) -> NDArray[np.uint16]:
        """Return (H, W) uint16 depth along the colour camera's axis, in the same unit, 0 where nothing was seen.

        Args:
            depth_counts: (h, w) uint16, 0 where there is no measurement.
        """
        counts = depth_counts.ravel()
        order = np.argsort(counts, kind="stable")[::-1]  # far to near: what is written last, wins
        order = order[: np.count_nonzero(counts)]
        u, v, depth_m = self._project(self._rays[:, order] * (counts[order] * self._unit_m) + self._t_m[:, None])
        values = np.rint(depth_m / self._unit_m).clip(0, _NONE - 1).astype(np.uint16)
        margin, (side_u, side_v) = self._margin_px, self._side_px
        height, width = self._color.height_px, self._color.width_px
        low_u = np.floor(u - (side_u / 2 - 1.0)).clip(-margin, width + margin).astype(np.int32)
        low_v = np.floor(v - (side_v / 2 - 1.0)).clip(-margin, height + margin).astype(np.int32)
        hit = (low_u > -side_u) & (low_u < width) & (low_v > -side_v) & (low_v < height) & (depth_m > 0)
        stride = width + 2 * margin
        target = ((low_v + margin) * stride + low_u + margin)[hit]
        values = values[hit]
        nearest = np.full((height + 2 * margin) * stride, _NONE, dtype=np.uint16)
        layer = np.empty_like(nearest)
        for dv in range(side_v):
            for du in range(side_u):
                layer.fill(_NONE)
                layer[target + (dv * stride + du)] = values
                np.minimum(nearest, layer, out=nearest)
        nearest[nearest == _NONE] = 0
        return nearest.reshape(-1, stride)[margin : margin + height, margin : margin + width].copy()

    def _project(self, points_m: NDArray[np.float32]) -> tuple[NDArray[np.float32], ...]:
        """Return u, v in colour pixels and the depths of (3, n) points in the colour frame."""
        c = self._color
        depth_m = points_m[2]
        safe_m = np.where(depth_m > 0, depth_m, np.float32(1.0))
        x, y = points_m[0] / safe_m, points_m[1] / safe_m
        if any(c.distortion):
            k1, k2, p1, p2, k3 = (np.float32(value) for value in c.distortion)
            r2 = x * x + y * y
            radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
            x, y = (
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y),
            )
        return np.float32(c.fx_px) * x + np.float32(c.cx_px), np.float32(c.fy_px) * y + np.float32(c.cy_px), depth_m


def _rays(camera: Intrinsics, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) rays with z = 1 through pixels."""
    pixels = np.stack([u.ravel(), v.ravel()], axis=1).reshape(-1, 1, 2)
    if any(camera.distortion):
        ideal = cv2.undistortPoints(pixels, camera.matrix, np.array(camera.distortion)).reshape(-1, 2)
    else:
        ideal = (pixels.reshape(-1, 2) - (camera.cx_px, camera.cy_px)) / (camera.fx_px, camera.fy_px)
    return np.column_stack([ideal, np.ones(len(ideal))])
