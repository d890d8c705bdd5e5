"""Sub-pixel centres of the disks whose place is already known to about a pixel.

Every pixel of an anti-aliased image is a mixture of disk and plate: pixel = s (plate + alpha (disk - plate)), with s the
local brightness. Inside and outside a band around the predicted edge alpha is one and zero; in the band it is measured,
alpha = <pixel / s - plate, disk - plate> / |disk - plate|^2. The alpha-weighted centroid is then the disk's, whatever the
width and shape of the edge. What lies off the line from plate to disk colour is neither: something covers the disk.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.vision.ellipses import DiskImage, MarkerImage
from ghest_rt.vision.layout import PLATE_LEVEL, MarkerLayout
from ghest_rt.vision.plate_light import PlateLight

Float32 = NDArray[np.float32]
Color = tuple[float, float, float]
Coefficients = tuple[float, float, float, float, float, float]
Places = list[tuple[float, float]]

_FOREIGN2 = 0.3**2  # squared distance from the mixing line, in units of |disk - plate|, beyond which a pixel is foreign
_MAX_FOREIGN = 0.02  # share of foreign pixels beyond which the disk counts as covered
_AREA_RANGE = (0.8, 1.25)  # measured over predicted area
_INSIDE_RANGE = (0.6, 1.6)  # mean alpha of the interior by the remembered colour
_LEAST_INSIDE = 0.2  # share of the radius that counts as interior whatever the band
_MIN_CONTRAST2 = 0.05**2  # least |disk - plate|^2 used, in units of |plate|^2
_CLIPPED_SIGMA_PX = 0.02  # what a clipped plate adds
_MIN_MINOR_PX = 1.8  # a flatter or smaller ellipse has no interior to speak of


@dataclass(frozen=True, slots=True)
class DiskCenter:
    """One disk as measured.

    Attributes:
        u: Centroid, pixels.
        v: Centroid, pixels.
        sigma_px: Standard deviation of each coordinate by the image noise found inside the disk, and by clipping.
        radius2_px: Squared geometric mean of the predicted semi-axes.
        relative: Mean colour of the interior, each channel divided by the plate's.
    """

    u: float
    v: float
    sigma_px: float
    radius2_px: float
    relative: Color


DiskCenters = tuple[DiskCenter | None, ...]  # p0..p3, None where the disk is not wholly seen


class DiskMeter:
    """Measures the four disks at once, by their colours relative to the plate's, which it is told as they become known.

    Attributes:
        relative: The colours of p0..p3, each channel divided by the plate's.
    """

    def __init__(self, layout: MarkerLayout) -> None:
        self._centers_m = layout.centers_m.tolist()
        self._nominal = [
            (red / PLATE_LEVEL, green / PLATE_LEVEL, blue / PLATE_LEVEL) for red, green, blue in layout.disk_rgb.tolist()
        ]
        self.relative = self._nominal
        self._grids: dict[int, tuple[Float32, Float32]] = {}

    def reset(self) -> None:
        """Return to the nominal colours."""
        self.relative = self._nominal

    def measure(
        self, image: NDArray[np.uint8], predicted: MarkerImage, light: PlateLight, band_px: float, places: Places
    ) -> DiskCenters:
        """Measure the disks.

        Args:
            image: (H, W, 3) colour image.
            predicted: What the disks should look like.
            light: The light on the plate.
            band_px: Half width of the band around the predicted edges; must cover half the edge's blur and the error of
                the places.
            places: Where the four centres are thought to be, pixels.
        """
        height, width = image.shape[:2]
        if predicted.minor_px < _MIN_MINOR_PX:
            return (None,) * 4
        band = band_px / predicted.minor_px
        half = int(predicted.extent_px * (1.0 + band)) + 1
        size = 2 * half + 1
        if size > min(height, width):
            return (None,) * 4
        basis, moments = self._grid(half)
        seen = _inside(image, places, predicted, 1.0 + band)
        if not any(seen):
            return (None,) * 4
        corners = []
        offsets = []
        quadratics = []
        pixels = np.empty((4, size, size, 3), dtype=np.float32)
        for k, (u, v) in enumerate(places):
            left = min(max(round(u) - half, 0), width - size)
            top = min(max(round(v) - half, 0), height - size)
            pixels[k] = image[top : top + size, left : left + size]
            corners.append((left + half, top + half))
            offsets.append((u - left - half, v - top - half))
            quadratics.append(ellipse_quadratic(predicted.disks[k], *offsets[k]))

        rows, bright = self._mixing(predicted, light, offsets)
        quad, brightness = (np.array(quadratics + bright, dtype=np.float32) @ basis).reshape(2, 4, -1)
        inside = quad < max(1.0 - band, _LEAST_INSIDE) ** 2  # quad is 1 on the predicted edges
        near = quad < (1.0 + band) ** 2
        mix = np.array(rows, dtype=np.float32)
        mixed = mix[:, :3].transpose(0, 2, 1) @ pixels.reshape(4, -1, 3).transpose(0, 2, 1)
        mixed *= brightness[:, None, :]
        mixed -= mix[:, 3, :, None]

        weight = inside.astype(np.float32)
        n_inside = np.maximum(weight @ moments[:, :1], 1.0)
        means = (mixed @ weight[:, :, None])[:, :, 0] / n_inside
        alpha = mixed[:, 0]
        alpha /= np.maximum(means[:, :1], _INSIDE_RANGE[0])
        filled = alpha * (near ^ inside)
        filled += weight
        np.subtract(filled, alpha, out=alpha)  # now zero in the band; inside and outside what the image should not hold
        squares = mixed * mixed
        distance2 = squares[:, 0]
        distance2 += squares[:, 1]
        distance2 += squares[:, 2]
        foreign = (distance2 > _FOREIGN2) & near
        n_foreign = [0, 0, 0, 0]
        if np.count_nonzero(foreign):
            n_foreign = np.add.reduce(foreign, axis=1).tolist()
            filled[foreign] = quad[foreign] < 1.0
        sums = (filled @ moments).tolist()
        centered = means.tolist()
        distance2 *= weight
        scatter = (np.add.reduce(distance2, axis=1, keepdims=True) / n_inside).tolist()

        found: list[DiskCenter | None] = []
        for k, disk in enumerate(predicted.disks):
            area, sum_u, sum_v = sums[k]
            radius2 = math.sqrt(max(disk.determinant, 0.0))
            a_in, b_in, c_in = centered[k]
            covered = n_foreign[k] > max(_MAX_FOREIGN * math.pi * radius2 * (1.0 + band) ** 2, 1.0)
            whole = seen[k] and not covered and _INSIDE_RANGE[0] < a_in < _INSIDE_RANGE[1]
            if not whole or not _AREA_RANGE[0] < area / (math.pi * radius2) < _AREA_RANGE[1]:
                found.append(None)
                continue
            # Of the noise, a third is in alpha; it moves the centroid through the band, of area 4 pi r^2 band.
            noise2 = max(scatter[k][0] - b_in * b_in - c_in * c_in, 0.0) / 3.0
            sigma_px = math.sqrt(noise2 * 4.0 * math.pi * radius2 * band * 0.5 * radius2) / area
            if light.clipped:
                sigma_px = math.hypot(sigma_px, _CLIPPED_SIGMA_PX)
            relative = _relative(rows[k], (a_in, b_in, c_in), light)
            found.append(DiskCenter(corners[k][0] + sum_u / area, corners[k][1] + sum_v / area, sigma_px, radius2, relative))
        return tuple(found)

    def _grid(self, half: int) -> tuple[Float32, Float32]:
        """Return [1, u, v, u^2, u v, v^2] (6, n) and [1, u, v] (n, 3) of a square patch of pixels around its middle."""
        if half not in self._grids:
            line = np.arange(-half, half + 1, dtype=np.float32)
            v, u = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
            one = np.ones_like(u)
            self._grids[half] = (np.stack([one, u, v, u * u, u * v, v * v]), np.stack([one, u, v], axis=1))
        return self._grids[half]

    def _mixing(
        self, predicted: MarkerImage, light: PlateLight, offsets: Places
    ) -> tuple[list[list[list[float]]], list[Coefficients]]:
        """Return per disk its mixing rows (see `mixing_rows`), and 1 / s as coefficients of [1, u, v, u^2, u v, v^2]."""
        a, b, c, d = predicted.plate_px
        scale = light.level / (a * d - b * c)
        slope_u, slope_v = scale * (d * light.slope[0] - c * light.slope[1]), scale * (a * light.slope[1] - b * light.slope[0])
        bright = []
        for (x_m, y_m), (u, v) in zip(self._centers_m, offsets, strict=True):
            inverse = 1.0 / (light.level * (1.0 + x_m * light.slope[0] + y_m * light.slope[1]))
            gu, gv = -slope_u * inverse * inverse, -slope_v * inverse * inverse
            bright.append((inverse - gu * u - gv * v, gu, gv, 0.0, 0.0, 0.0))
        return [mixing_rows(light.rgb, relative) for relative in self.relative], bright


def _inside(image: NDArray[np.uint8], places: Places, predicted: MarkerImage, reach: float) -> list[bool]:
    """Return of each ellipse whether it lies wholly in the image when grown by the factor `reach`."""
    height, width = image.shape[:2]
    least = reach * predicted.extent_px
    (u_0, v_0), (u_1, v_1), (u_2, v_2), (u_3, v_3) = places
    right, below = max(u_0, u_1, u_2, u_3), max(v_0, v_1, v_2, v_3)
    if least <= min(u_0, u_1, u_2, u_3, v_0, v_1, v_2, v_3) and right <= width - 1 - least and below <= height - 1 - least:
        return [True, True, True, True]
    seen = []
    for (u, v), disk in zip(places, predicted.disks, strict=True):
        du, dv = reach * math.sqrt(max(disk.a, 0.0)), reach * math.sqrt(max(disk.c, 0.0))
        seen.append(du <= u <= width - 1 - du and dv <= v <= height - 1 - dv)
    return seen


def ellipse_quadratic(disk: DiskImage, x: float, y: float) -> Coefficients:
    """Return (p - o)^T S^-1 (p - o) with o = (x, y) as coefficients of [1, u, v, u^2, u v, v^2]; 1 on the edge."""
    a, b, c = disk.c, disk.b, disk.a
    inverse = 1.0 / max(a * c - b * b, 1e-12)
    a, b, c = a * inverse, -b * inverse, c * inverse
    au, av = a * x + b * y, b * x + c * y
    return (x * au + y * av, -2.0 * au, -2.0 * av, a, 2.0 * b, c)


def mixing_rows(plate: tuple[float, float, float], relative: Color) -> list[list[float]]:
    """Return what turns a colour into alpha and two coordinates across the line from plate to disk colour.

    Four rows of three numbers: the factors of red, green and blue, and what to take off; all three coordinates have alpha's
    unit, |disk - plate|.
    """
    p, q, r = plate
    x, y, z = (relative[0] - 1.0) * p, (relative[1] - 1.0) * q, (relative[2] - 1.0) * r
    norm2 = max(x * x + y * y + z * z, _MIN_CONTRAST2 * (p * p + q * q + r * r))
    inverse = 1.0 / math.sqrt(norm2)
    if abs(x) < abs(y):  # any unit vector across (x, y, z), and the one across both
        flat = inverse / math.sqrt(y * y + z * z)
        a, b, c = 0.0, -z * flat, y * flat
    else:
        flat = inverse / (math.sqrt(x * x + z * z) or 1.0)
        a, b, c = z * flat, 0.0, -x * flat
    x, y, z = x / norm2, y / norm2, z / norm2
    root = 1.0 / inverse
    d, e, f = (y * c - z * b) * root, (z * a - x * c) * root, (x * b - y * a) * root
    return [[x, a, d], [y, b, e], [z, c, f], [x * p + y * q + z * r, a * p + b * q + c * r, d * p + e * q + f * r]]


def _relative(rows: list[list[float]], means: tuple[float, float, float], light: PlateLight) -> Color:
    """Return a colour, given by its three mixing coordinates, with each channel divided by the plate's."""
    (x, a, d), (y, b, e), (z, c, f) = rows[:3]
    m, n, o = means
    norm2 = 1.0 / (x * x + y * y + z * z)
    red, green, blue = light.rgb
    return (
        1.0 + norm2 * (x * m + a * n + d * o) / max(red, 1e-6),
        1.0 + norm2 * (y * m + b * n + e * o) / max(green, 1e-6),
        1.0 + norm2 * (z * m + c * n + f * o) / max(blue, 1e-6),
    )
