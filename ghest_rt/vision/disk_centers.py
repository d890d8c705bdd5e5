"""Sub-pixel centres of the disks whose place is already known to about a pixel.

Every pixel of an anti-aliased image is a mixture of disk and plate: pixel = s (plate + alpha (disk - plate)), with s the
local brightness. Inside and outside a band around the predicted edge alpha is one and zero; in the band it is measured,
alpha = <pixel / s - plate, disk - plate> / |disk - plate|^2. The alpha-weighted centroid is then the disk's, whatever the
width and shape of the edge. What lies off the line from plate to disk colour is neither: something covers the disk.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.ellipses import DiskImages
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.plate_light import PlateLight

Float32 = NDArray[np.float32]

_FOREIGN2 = 0.3**2  # squared distance from the mixing line, in units of |disk - plate|, beyond which a pixel is foreign
_MAX_FOREIGN = 0.02  # share of foreign pixels beyond which the disk counts as covered
_AREA_RANGE = (0.8, 1.25)  # measured over predicted area
_INSIDE_RANGE = (0.6, 1.6)  # mean alpha of the interior by the remembered colour
_MIN_CONTRAST = 0.05  # least |disk - plate| used, in units of |plate|
_MIN_MINOR_PX = 1.8  # a flatter or smaller ellipse has no interior to speak of
_PLATE_LEVEL = 238.0  # what a channel of a white plate reads where the nominal colours are given


@dataclass(frozen=True, slots=True, eq=False)
class DiskCenters:
    """What was measured of each disk.

    Attributes:
        good: (4,) bool, whether the disk is wholly seen and looks as it should.
        centers_px: (4, 2) centroids; meaningless where not good.
        sigma_px: (4,) standard deviation of each coordinate by the image noise found inside the disks.
        shift_px: Greatest distance of a good disk's centroid from where it was predicted.
        radius2_px: (4, 1) squared geometric mean of the semi-axes.
        relative: (4, 3) mean colour of the interiors, each channel divided by the plate's.
    """

    good: NDArray[np.bool_]
    centers_px: Array
    sigma_px: Array
    shift_px: float
    radius2_px: Array
    relative: Array


class DiskMeter:
    """Measures the four disks at once, by their colours relative to the plate's, which it is told as they become known."""

    def __init__(self, layout: MarkerLayout) -> None:
        self._centers_m = layout.centers_m
        self._nominal = layout.disk_rgb / _PLATE_LEVEL
        self.relative = self._nominal
        self._grids: dict[int, tuple[Float32, Float32]] = {}

    def reset(self) -> None:
        """Return to the nominal colours."""
        self.relative = self._nominal

    def measure(
        self,
        image: NDArray[np.uint8],
        predicted: DiskImages,
        light: PlateLight,
        band_px: float,
        centers_px: Array | None = None,
    ) -> DiskCenters:
        """Measure the disks.

        Args:
            image: (H, W, 3) colour image.
            predicted: Where the disks should appear.
            light: The light on the plate.
            band_px: Half width of the band around the predicted edges; must cover half the edge's blur and the error of
                the prediction.
            centers_px: (4, 2) better centres than the predicted ones, if known.
        """
        height, width = image.shape[:2]
        centers_px = predicted.centers_px if centers_px is None else centers_px
        minor_px = max(predicted.minor_px, 1e-3)
        band = band_px / minor_px
        half = int(predicted.extent_px * (1.0 + band)) + 2
        size = 2 * half + 1
        S = predicted.shapes_px2
        determinants = S[:, 0, 0] * S[:, 1, 1] - S[:, 0, 1] ** 2
        radius2_px = np.sqrt(determinants)[:, None]
        reach_px = np.sqrt(S[:, (0, 1), (0, 1)]) * (1.0 + band)
        border = np.minimum(centers_px - reach_px, (width - 1, height - 1) - centers_px - reach_px).min(axis=1)
        usable = border >= 0.0
        if minor_px < _MIN_MINOR_PX or size > min(height, width) or not usable.any():
            return DiskCenters(np.zeros(4, dtype=bool), centers_px, np.ones(4), 0.0, radius2_px, self.relative)

        corners = np.rint(centers_px).astype(np.intp) - half
        np.clip(corners, 0, (width - size, height - size), out=corners)
        pixels = np.empty((4, size, size, 3), dtype=np.float32)
        for k, (u, v) in enumerate(corners.tolist()):
            pixels[k] = image[v : v + size, u : u + size]
        basis, moments = self._grid(half)
        offsets = centers_px - corners - half

        quad = _quadratics(S / determinants[:, None, None], offsets) @ basis  # 1 on the predicted edges
        mixing, constant, bright = self._mixing(predicted, light, offsets)
        flat = pixels.reshape(4, -1, 3)
        mixed = mixing @ flat.transpose(0, 2, 1)
        mixed *= (bright @ basis[:3])[:, None, :]
        mixed -= constant
        alpha = mixed[:, 0]
        inside = quad < max(1.0 - band, 0.2) ** 2
        near = quad < (1.0 + band) ** 2
        n_inside = np.count_nonzero(inside, axis=1)
        alpha_in = np.einsum("kn,kn->k", alpha, inside) / n_inside
        usable &= (alpha_in > _INSIDE_RANGE[0]) & (alpha_in < _INSIDE_RANGE[1])
        alpha /= np.where(usable, alpha_in, 1.0)[:, None].astype(np.float32)

        filled = np.where(near, alpha, np.float32(0.0))
        filled[inside] = 1.0
        distance2 = np.einsum("kcn,kcn->kn", mixed[:, 1:], mixed[:, 1:])
        off_inside = (filled - alpha) * near
        distance2 += off_inside * off_inside
        foreign = near & (distance2 > _FOREIGN2)
        n_foreign = np.count_nonzero(foreign, axis=1)
        if n_foreign.any():
            filled[foreign] = quad[foreign] < 1.0
        sums = filled @ moments
        area = np.maximum(sums[:, 0], 1.0).astype(np.float64)
        found = sums[:, 1:] / area[:, None] + corners + half
        ratio = area / (np.pi * radius2_px[:, 0])
        n_near = np.count_nonzero(near, axis=1)
        good = (
            usable & (n_foreign <= np.maximum(_MAX_FOREIGN * n_near, 1)) & (ratio > _AREA_RANGE[0]) & (ratio < _AREA_RANGE[1])
        )
        noise2 = np.einsum("kn,kn->k", off_inside, off_inside) / np.maximum(n_inside, 1)
        sigma_px = np.sqrt(noise2 * (n_near - n_inside) * 0.5 * radius2_px[:, 0]) / area
        shift_px = float(np.abs(found - centers_px)[good].max()) if good.any() else 0.0
        inner_rgb = (inside.astype(np.float32)[:, None, :] @ flat)[:, 0] / n_inside[:, None]
        relative = inner_rgb * bright[:, :1] / light.rgb
        return DiskCenters(good, found, sigma_px, shift_px, radius2_px, relative)

    def _mixing(self, predicted: DiskImages, light: PlateLight, offsets: Array) -> tuple[Float32, Float32, Float32]:
        """Return (4, 3, 3) rows (alpha, two across) and (4, 3, 1) constants per disk, and 1 / s in the patch's [1, u, v]."""
        level = light.level * (1.0 + self._centers_m @ light.slope)
        slope = (light.level * light.slope) @ np.linalg.inv(predicted.plate_px)
        bright = np.empty((4, 3), dtype=np.float32)
        bright[:, 1:] = -slope / (level * level)[:, None]
        bright[:, 0] = 1.0 / level + (offsets @ slope) / (level * level)
        plate = light.rgb
        rows = np.array([_mixing_rows(plate.tolist(), relative) for relative in self.relative.tolist()])
        return rows.astype(np.float32), (rows @ plate)[:, :, None].astype(np.float32), bright

    def _grid(self, half: int) -> tuple[Float32, Float32]:
        """Return [1, u, v, u^2, u v, v^2] (6, n) and [1, u, v] (n, 3) of a square patch of pixels around its middle."""
        if half not in self._grids:
            line = np.arange(-half, half + 1, dtype=np.float32)
            v, u = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
            one = np.ones_like(u)
            self._grids[half] = (np.stack([one, u, v, u * u, u * v, v * v]), np.stack([one, u, v], axis=1))
        return self._grids[half]


def _quadratics(S_over_det: Array, offsets: Array) -> Float32:
    """Return (4, 6): (x - o)^T S^-1 (x - o) as coefficients of [1, u, v, u^2, u v, v^2]."""
    a, b, c = S_over_det[:, 1, 1], -S_over_det[:, 0, 1], S_over_det[:, 0, 0]
    x, y = offsets[:, 0], offsets[:, 1]
    ax_by, bx_cy = a * x + b * y, b * x + c * y
    return np.stack([x * ax_by + y * bx_cy, -2 * ax_by, -2 * bx_cy, a, 2 * b, c], axis=1).astype(np.float32)


def _mixing_rows(plate: list[float], relative: list[float]) -> list[list[float]]:
    """Return the rows that turn a colour into alpha and two coordinates across the line from plate to disk colour."""
    x, y, z = ((r - 1.0) * p for p, r in zip(plate, relative, strict=True))
    norm2 = max(x * x + y * y + z * z, _MIN_CONTRAST**2 * sum(p * p for p in plate))
    # Any unit vector across v, and v times it: both of length 1 / |v|, so that all three coordinates have alpha's unit.
    if abs(x) < abs(y):
        flat = (y * y + z * z) ** 0.5 or 1.0
        across = (0.0, -z / flat, y / flat)
    else:
        flat = (x * x + z * z) ** 0.5 or 1.0
        across = (z / flat, 0.0, -x / flat)
    norm = norm2**0.5
    third = (y * across[2] - z * across[1], z * across[0] - x * across[2], x * across[1] - y * across[0])
    return [[x / norm2, y / norm2, z / norm2], [a / norm for a in across], [t / norm2 for t in third]]
