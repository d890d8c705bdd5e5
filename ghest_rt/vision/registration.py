"""Depth seen from another place than colour: bring it into the colour image."""

import cv2
import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import CameraInfo, Intrinsics
from ghest_rt.geometry.so3 import Array

Depth = NDArray[np.uint16]
_SAME_PX = 0.05
_EMPTY = np.iinfo(np.uint16).max
# What is farther than the pixels around it by this factor lies on a surface behind them.
_BEHIND = 1.05


def is_registered(info: CameraInfo) -> bool:
    """Whether depth is measured along the colour camera's rays: the same optical centre, axes and (scaled) intrinsics."""
    color, depth = info.color, info.depth
    # Pixel edges, not centres, scale with the resolution: hence the halves.
    ratio_u, ratio_v = depth.width_px / color.width_px, depth.height_px / color.height_px
    off_px = (
        depth.fx_px - ratio_u * color.fx_px,
        depth.fy_px - ratio_v * color.fy_px,
        depth.cx_px + 0.5 - ratio_u * (color.cx_px + 0.5),
        depth.cy_px + 0.5 - ratio_v * (color.cy_px + 0.5),
    )
    same_rays = bool(np.abs(off_px).max() < _SAME_PX) and color.distortion == depth.distortion
    return same_rays and bool(np.abs(info.color_from_depth - np.eye(4)).max() < 1e-9)


def ray_grid(intrinsics: Intrinsics) -> Array:
    """Return (h, w, 2): x/z and y/z of the ray through every pixel's centre, lens distortion taken off."""
    u, v = np.meshgrid(np.arange(intrinsics.width_px, dtype=np.float64), np.arange(intrinsics.height_px, dtype=np.float64))
    pixels = np.stack([u, v], axis=-1)
    if not any(intrinsics.distortion):
        focal = np.array([intrinsics.fx_px, intrinsics.fy_px])
        return np.asarray((pixels - (intrinsics.cx_px, intrinsics.cy_px)) / focal, dtype=np.float64)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-10)
    rays = cv2.undistortPointsIter(
        pixels.reshape(-1, 1, 2), intrinsics.matrix, np.array(intrinsics.distortion), np.eye(3), np.eye(3), criteria
    )
    return np.asarray(rays, dtype=np.float64).reshape(pixels.shape)


class DepthRegistration:
    """Moves a depth image into the colour image, each measurement to the nearest pixel, the nearest surface winning."""

    def __init__(self, info: CameraInfo) -> None:
        self._info = info
        self._rays = np.concatenate([ray_grid(info.depth), np.ones((info.depth.height_px, info.depth.width_px, 1))], axis=2)
        self._rays = self._rays @ info.color_from_depth[:3, :3].T
        self._shift_m = info.color_from_depth[:3, 3]

    def __call__(self, depth_counts: Depth) -> Depth:
        """Return depth along the colour camera's z axis: (H, W) uint16 counts of the colour image's size, 0 where unknown."""
        info = self._info
        seen = depth_counts > 0
        points_m = self._rays[seen] * (depth_counts[seen, None] * info.depth_unit_m) + self._shift_m
        points_m = points_m[points_m[:, 2] > info.depth_unit_m]
        registered = np.full((info.color.height_px, info.color.width_px), _EMPTY, dtype=np.uint16)
        if len(points_m):
            pixels, _ = cv2.projectPoints(
                points_m, np.zeros(3), np.zeros(3), info.color.matrix, np.array(info.color.distortion)
            )
            u, v = np.rint(pixels.reshape(-1, 2)).astype(np.int64).T
            counts = np.rint(points_m[:, 2] / info.depth_unit_m)
            inside = (u >= 0) & (u < info.color.width_px) & (v >= 0) & (v < info.color.height_px) & (counts < registered[0, 0])
            np.minimum.at(registered, (v[inside], u[inside]), counts[inside].astype(np.uint16))
        # Neighbouring measurements may land two pixels apart: what is empty between takes the nearest surface next to it, as
        # does a pixel that shows a surface behind through such a gap.
        nearest = cv2.erode(registered, np.ones((3, 3), np.uint8))
        filled = np.where(registered == _EMPTY, nearest, registered)
        filled = np.where(filled > _BEHIND * cv2.medianBlur(filled, 3), nearest, filled)
        return np.where(filled == _EMPTY, np.uint16(0), filled).astype(np.uint16)
