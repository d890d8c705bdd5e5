"""The pixels near the edges of the disks: what they show, and how far they are from the edges that a pose predicts.

The ray of every pixel is taken back to the plate by the inverse homography G: X = G ray / (G_3 ray), exact for any lens. With
n = (X - c) / |X - c| the plate distance from the edge is e = |X - c| - r and its gradient by a displacement of the plate
point's camera coordinates is k = G^T (n, -n . X), perpendicular to the ray; a plate that moves by w x q + t (q from the
plate's origin) changes e by -k . (w x q + t). Divided by |grad e| in the image all this is in pixels.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.disk_centers import DiskCenters, mixing_rows
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.sighting import Sighting

_LEAST_DISKS = 3
_LEAST_FACING = 0.3  # cosine of the steepest slant for which the band is lengthened
_OF_RADIUS = 0.7  # share of the radius that the band may take
_OFF_AXIS = 1.15  # how much larger things may appear off the camera's axis
_EDGE_PX = 1.3  # half width of the band of pixels at the edge, besides blur
_BLURS = 2.5  # how many standard deviations of blur the band takes in
_OF_MARGIN = 0.8  # share of the white margin that the band may take


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Pixels beside the edges of a pose.

    Attributes:
        distance_px: (n,) distance from the edge, positive outside the disk.
        jacobian: (6, n) its derivative by rotation (rad) and translation (m) of the plate in camera axes.
        curvature: (n,) of the edge, 1/px.
        sine2: (n,) |sin 2t| of the direction t of the edge's normal.
    """

    distance_px: Array
    jacobian: Array
    curvature: Array
    sine2: Array


@dataclass(frozen=True, slots=True, eq=False)
class EdgePixels:
    """The pixels chosen.

    Attributes:
        rays: (3, n) rays (x, y, 1).
        centers_m: (2, n) centres of the disks they are at.
        alpha: (n,) measured coverage.
        contrast: (n,) what coverage one means in the image, in 255ths.
        focal_px: (n,) scale from rays to pixels.
        radius_m: Radius of the disks.
    """

    rays: Array
    centers_m: Array
    alpha: Array
    contrast: Array
    focal_px: Array
    radius_m: float

    def edges(self, R: Array, p_m: Array) -> Edges | None:
        """Return where the pixels are with respect to the edges; None if the pose is seen edge on."""
        G = _plate_from_ray(R, p_m)
        if G is None:
            return None
        hom = G @ self.rays
        depth_m = 1.0 / hom[2]
        place = hom[:2] * depth_m
        n = np.empty((3, len(depth_m)))
        np.subtract(place, self.centers_m, out=n[:2])
        rho = np.sqrt(n[0] * n[0] + n[1] * n[1])
        n[:2] /= rho
        n[2] = -(n[0] * place[0] + n[1] * place[1])
        k = G.T @ n
        across = np.sqrt(k[0] * k[0] + k[1] * k[1])
        scale = self.focal_px / (across * depth_m)  # pixels per metre across the edge
        jacobian = np.empty((6, len(depth_m)))
        np.multiply(k, -scale, out=jacobian[3:])
        qx, qy, qz = self.rays * depth_m - p_m[:, None]
        fx, fy, fz = jacobian[3:]
        jacobian[0] = qy * fz - qz * fy
        jacobian[1] = qz * fx - qx * fz
        jacobian[2] = qx * fy - qy * fx
        area = (
            abs(_determinant(G)) / (self.focal_px * self.focal_px) * (depth_m * depth_m * depth_m)
        )  # of a pixel, on the plate
        curvature = area * area * (scale * scale * scale) / rho
        return Edges((rho - self.radius_m) * scale, jacobian, curvature, 2.0 * np.abs(k[0] * k[1]) / (across * across))


class EdgePixelSampler:
    """Chooses the pixels and reads them."""

    def __init__(self, layout: MarkerLayout, optics: Optics) -> None:
        self._layout = layout
        self._optics = optics
        self._rays = optics.ray_table()
        self._steps = np.array([0, 1, optics.width_px])
        self._patches: dict[int, tuple[NDArray[np.intp], NDArray[np.float32]]] = {}
        self._margin_m = layout.half_plate_m - float(np.abs(layout.centers_m).max()) - layout.radius_m

    def __call__(self, sighting: Sighting, R: Array, p_m: Array, blur_px: float) -> EdgePixels | None:
        """Return the pixels near the edges that a pose predicts; None if too few disks are seen."""
        seen = [k for k, disk in enumerate(sighting.measured) if disk is not None]
        G = _plate_from_ray(R, p_m)
        if len(seen) < _LEAST_DISKS or G is None:
            return None
        centers_m = self._layout.centers_m[seen]
        radius_m = self._layout.radius_m
        focal_px = self._optics.mean_focal_px
        # A pixel is longer on a slanted plate: what is too far from the edge says nothing, and does no harm.
        facing = max(-float(R[:, 2] @ p_m) / math.sqrt(float(p_m @ p_m)), _LEAST_FACING)
        band_m = (_EDGE_PX + _BLURS * blur_px) * float(p_m[2]) / (focal_px * facing)
        inner_m = radius_m - min(band_m, _OF_RADIUS * radius_m)
        outer_m = radius_m + min(band_m, _OF_MARGIN * self._margin_m)
        nearest_m = float(p_m[2]) + float((centers_m @ R[2, :2]).min()) - radius_m
        half = math.ceil(outer_m / nearest_m * focal_px * _OFF_AXIS)
        if 2 * half + 1 > min(self._optics.width_px, self._optics.height_px):
            return None
        middles = self._middles(sighting.measured, half)
        grid, basis = self._patch(half)

        # To choose pixels, the lens is straight enough across one disk.
        around = self._rays.take(middles[:, None] + self._steps, axis=1)
        slopes = around[:2, :, 1:] - around[:2, :, :1]
        frames = np.zeros((len(seen), 3, 3))
        frames[:, :, 0] = around[:, :, 0].T
        frames[:, :2, 1:] = slopes.transpose(1, 0, 2)
        hom = G @ frames
        hom[:, :2] -= centers_m[:, :, None] * hom[:, 2:]
        x, y, w = (hom.astype(np.float32) @ basis).transpose(1, 0, 2)
        rho2 = (x * x + y * y) / (w * w)
        near = np.flatnonzero((rho2 > np.float32(inner_m * inner_m)) & (rho2 < np.float32(outer_m * outer_m)))
        owner, local = np.divmod(near, len(grid))
        index = middles[owner] + grid[local]
        rays = self._rays.take(index, axis=1)
        hom_near = G @ rays
        alpha, contrast = self._coverage(sighting, index, owner, hom_near[:2] / hom_near[2])
        scales = 1.0 / np.sqrt(np.abs(slopes[0, :, 0] * slopes[1, :, 1] - slopes[0, :, 1] * slopes[1, :, 0]))
        return EdgePixels(rays, centers_m.T.take(owner, axis=1), alpha, contrast, scales[owner], radius_m)

    def _middles(self, measured: DiskCenters, half: int) -> NDArray[np.intp]:
        """Return the flat indices of the pixels at the disks' middles, moved so that a patch around them is in the image."""
        width, height = self._optics.width_px, self._optics.height_px
        return np.array(
            [
                min(max(round(disk.v), half), height - 1 - half) * width + min(max(round(disk.u), half), width - 1 - half)
                for disk in measured
                if disk is not None
            ]
        )

    def _patch(self, half: int) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
        """Return a square patch around its middle: flat indices (n,) and [1, u, v] (3, n)."""
        if half not in self._patches:
            line = np.arange(-half, half + 1)
            v, u = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
            basis = np.stack([np.ones_like(u), u, v]).astype(np.float32)
            self._patches[half] = (v * self._optics.width_px + u, basis)
        return self._patches[half]

    def _coverage(
        self, sighting: Sighting, index: NDArray[np.intp], owner: NDArray[np.intp], place_m: Array
    ) -> tuple[Array, Array]:
        """Return the coverage that the pixels show, and what coverage one means in the image.

        Args:
            sighting: Image, light and colours.
            index: (n,) flat indices of the pixels.
            owner: (n,) which of the disks seen a pixel belongs to.
            place_m: (2, n) where the pixels are on the plate.
        """
        light = sighting.light
        rows = np.array([mixing_rows(light.rgb, disk.relative) for disk in sighting.measured if disk is not None])[:, :, 0]
        mix = rows[owner]
        brightness = light.level * (1.0 + light.slope[0] * place_m[0] + light.slope[1] * place_m[1])
        pixels = sighting.image.reshape(-1, 3).take(index, axis=0)
        mixed = pixels * mix[:, :3]
        alpha = (mixed[:, 0] + mixed[:, 1] + mixed[:, 2]) / brightness - mix[:, 3]
        contrast = brightness / np.sqrt((rows[:, :3] * rows[:, :3]).sum(axis=1))[owner]
        return alpha, contrast


def _plate_from_ray(R: Array, p_m: Array) -> Array | None:
    """Return the inverse homography (3, 3), rays to plate coordinates over depth; None if the plate is seen edge on."""
    distance_m = float(R[:, 2] @ p_m)
    if abs(distance_m) < 1e-6:
        return None
    # (x, y, 1) Z = X r1 + Y r2 + p, and 1/Z = n . (x, y, 1) / (n . p)
    G = R.T / distance_m
    G[:2] = R.T[:2] - (p_m @ R[:, :2])[:, None] * G[2]
    return G


def _determinant(M: Array) -> float:
    (a, b, c), (d, e, f), (g, h, i) = M.tolist()
    return float(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
