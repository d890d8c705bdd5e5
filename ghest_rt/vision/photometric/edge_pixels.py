"""The pixels near the edges of the disks: what they show, and how far they are from the edges that a pose predicts.

The ray of every pixel is taken back to the plate by the inverse homography G: X = G ray / (G_3 ray), exact for any lens. With
n = (X - c) / |X - c| the plate distance from the edge is e = |X - c| - r and its gradient by a displacement of the plate
point is k, in plate axes k = (n_x, n_y, -n . (X + p_xy) / p_z) with p the plate's origin in these axes; k is perpendicular to
the ray. A plate that moves by w x q + t (q from the plate's origin) changes e by -k . (w x q + t). Divided by |grad e| in the
image all this is in pixels.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.disk_centers import Color, ellipse_quadratic
from ghest_rt.vision.ellipses import MarkerImage
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.photometric.mosaic import MosaicSense
from ghest_rt.vision.plate_light import PlateLight
from ghest_rt.vision.sighting import Sighting

_LEAST_DISKS = 3
_LEAST_RADIUS = 0.3  # share of the radius that is never an edge
_EDGE_PX = 1.3  # half width of the band of pixels at the edge, besides blur
_BLURS = 2.5  # how many standard deviations of blur the band takes in
_LEAST_STEP = 0.05  # between the colours of plate and disk, in units of brightness
_OF_MARGIN = 0.8  # share of the white margin that the band may take

Float32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Pixels beside the edges of a pose.

    Attributes:
        distance_px: (n,) distance from the edge, positive outside the disk.
        jacobian: (6, n) its derivative by rotation (rad) about x, -y and z and translation (m) of the plate, in plate axes.
        normal: (2, n) direction across the edge in the image, outwards.
        curvature: (n,) of the edge, 1/px.
        half_sine2: (n,) |sin 2t| / 2 of the direction t of the normal.
    """

    distance_px: Array
    jacobian: Array
    normal: Array
    curvature: Array
    half_sine2: Array


@dataclass(frozen=True, slots=True, eq=False)
class EdgePixels:
    """The pixels chosen, disk by disk and row by row.

    Attributes:
        rays: (3, n) rays (x, y, 1).
        centers_m: (2, n) centres of the disks they are at.
        spans: The pixels of each disk seen.
        excess: (n,) what a pixel shows beyond the plate's colour, along the step from plate to disk, of 255.
        contrast: (n,) the size of that step: coverage is excess over contrast.
        focal_px: (n,) or one scale from rays to pixels.
        mean_focal_px: Its mean.
        radius_m: Radius of the disks.
    """

    rays: Array
    centers_m: Array
    spans: list[slice]
    excess: Array
    contrast: Array
    focal_px: Array | float
    mean_focal_px: float
    radius_m: float

    def edges(self, R: Array, p_m: Array) -> Edges | None:
        """Return where the pixels are with respect to the edges; None if the pose is seen edge on."""
        px, py, pz = (p_m @ R).tolist()  # in plate axes; p_z is the distance of the camera from the plane
        if abs(pz) < 1e-6:
            return None
        # (x, y, 1) Z = X r1 + Y r2 + p, and 1/Z = r3 . (x, y, 1) / p_z: the homography's rows for X, Y and 1,
        # and between them those for -(X + p_x) / p_z and -(Y + p_y) / p_z, which are Z times rows of R^T.
        r1, r2, r3 = R.T
        inverse = 1.0 / pz
        G = np.empty((5, 3))
        np.multiply(r3, inverse, out=G[4])
        np.subtract(r1, px * G[4], out=G[0])
        np.subtract(r2, py * G[4], out=G[1])
        np.multiply(R.T[:2], -inverse, out=G[2:4])
        hom = G @ self.rays
        plate = hom[:4] / hom[4]
        place = plate[:2]
        count = place.shape[1]
        k = np.empty((3, count))
        n = k[:2]
        np.subtract(place, self.centers_m, out=n)
        square = n * n
        rho = np.sqrt(square[0] + square[1])
        n /= rho
        np.multiply(n, plate[2:], out=square)
        np.add(square[0], square[1], out=k[2])
        normal = R[:2] @ k
        np.multiply(normal, normal, out=square)
        length = np.sqrt(square[0] + square[1])
        normal /= length
        scale = hom[4] / length
        scale *= self.focal_px  # pixels per metre across the edge
        jacobian = np.empty((6, count))
        np.multiply(k, -scale, out=jacobian[3:])
        np.multiply(place[::-1], jacobian[5], out=jacobian[:2])
        np.multiply(place, jacobian[4:2:-1], out=square)
        np.subtract(square[0], square[1], out=jacobian[2])
        length *= hom[4]
        curvature = self.focal_px / length
        curvature *= curvature * curvature
        curvature *= 1.0 / (pz * pz * self.mean_focal_px**4 * self.radius_m)  # det G = 1 / p_z
        rho -= self.radius_m
        rho *= scale
        return Edges(rho, jacobian, normal, curvature, np.abs(normal[0] * normal[1]))


class EdgePixelSampler:
    """Chooses the pixels and reads them."""

    def __init__(self, layout: MarkerLayout, optics: Optics) -> None:
        self._layout = layout
        self._centers_m = [(float(x), float(y)) for x, y in layout.centers_m]
        self._optics = optics
        self._rays = optics.ray_table()
        self._mosaic = MosaicSense()
        self._patches: dict[int, tuple[NDArray[np.intp], NDArray[np.intp], Float32]] = {}
        margin_m = layout.half_plate_m - float(np.abs(layout.centers_m).max()) - layout.radius_m
        self._widest = 1.0 + _OF_MARGIN * margin_m / layout.radius_m

    def reset(self) -> None:
        """Forget which colours the camera interpolates."""
        self._mosaic.reset()

    def __call__(self, sighting: Sighting, blur_px: float) -> EdgePixels | None:
        """Return the pixels near the edges; None if too few disks are seen."""
        seen = [(k, disk) for k, disk in enumerate(sighting.measured) if disk is not None]
        if len(seen) < _LEAST_DISKS:
            return None
        predicted = sighting.predicted
        # Along the minor axis a pixel is longest on the plate: what is too far from the edge elsewhere does no harm.
        band = (_EDGE_PX + _BLURS * blur_px) / predicted.minor_px
        inner, outer = max(1.0 - band, _LEAST_RADIUS), min(1.0 + band, self._widest)
        half = math.ceil(predicted.extent_px * outer) + 1
        width, height = self._optics.width_px, self._optics.height_px
        if 2 * half + 1 > min(width, height):
            return None
        offsets, owners, basis = self._patch(half)
        middle2, width2 = 0.5 * (outer * outer + inner * inner), 0.5 * (outer * outer - inner * inner)
        light = sighting.light
        slope_u, slope_v = _brightness_slope(light, predicted)
        shapes, bright, middles = [], [], []
        for k, disk in seen:
            u, v = min(max(round(disk.u), half), width - 1 - half), min(max(round(disk.v), half), height - 1 - half)
            middles.append(v * width + u)
            right, down = disk.u - u, disk.v - v
            first, *others = ellipse_quadratic(predicted.disks[k], right, down)
            shapes.append((first - middle2, *others))
            x_m, y_m = self._centers_m[k]
            here = light.level * (1.0 + x_m * light.slope[0] + y_m * light.slope[1])
            bright.append((here - slope_u * right - slope_v * down, slope_u, slope_v, 0.0, 0.0, 0.0))
        quad, brightness = (np.array(shapes + bright, dtype=np.float32) @ basis).reshape(2, -1)
        (near,) = (np.abs(quad, out=quad) < np.float32(width2)).nonzero()
        owner = owners.take(near)
        index = np.add.outer(middles, offsets).take(near)
        bounds = near.searchsorted([n * len(offsets) for n in range(len(seen) + 1)]).tolist()
        self._learn(sighting, half)
        numbers = [k for k, _ in seen]
        excess, contrast, centers_m = self._colors(sighting, index, owner, brightness.take(near), numbers)
        return EdgePixels(
            rays=self._rays.take(index, axis=1),
            centers_m=centers_m,
            spans=[slice(first, last) for first, last in itertools.pairwise(bounds)],
            excess=excess,
            contrast=contrast,
            focal_px=self._scales(sighting, numbers, owner),
            mean_focal_px=self._optics.mean_focal_px,
            radius_m=self._layout.radius_m,
        )

    def _patch(self, half: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Float32]:
        """Return a square patch around its middle.

        Returns:
            (n,) flat indices, (4 n,) which of four patches in a row a pixel belongs to, and (6, n) [1, u, v, u^2, u v, v^2].
        """
        if half not in self._patches:
            line = np.arange(-half, half + 1)
            v, u = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
            basis = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v]).astype(np.float32)
            owners = np.repeat(np.arange(len(self._centers_m)), len(u))
            self._patches[half] = (v * self._optics.width_px + u, owners, basis)
        return self._patches[half]

    def _learn(self, sighting: Sighting, half: int) -> None:
        if self._mosaic.settled:
            return
        disks = sighting.predicted.disks
        rows, columns = [round(disk.v) for disk in disks], [round(disk.u) for disk in disks]
        self._mosaic.learn(sighting.image, (min(rows) - half, max(rows) + half), (min(columns) - half, max(columns) + half))

    def _colors(
        self, sighting: Sighting, index: NDArray[np.intp], owner: NDArray[np.intp], brightness: Float32, seen: list[int]
    ) -> tuple[Array, Array, Array]:
        """Return what the pixels show beyond the plate's colour along the step to the disk's, its size, and the centres.

        Args:
            sighting: Image, light and colours.
            index: (n,) flat indices of the pixels.
            owner: (n,) which of the disks seen a pixel belongs to.
            brightness: (n,) of the plate at the pixels.
            seen: Numbers of the disks seen.
        """
        steps = [
            (*_step(sighting.light, disk.relative), *self._centers_m[k])
            for k in seen
            if (disk := sighting.measured[k]) is not None
        ]
        channels = self._mosaic.channels
        if channels is None:
            table = [(r / size, g / size, b / size, level, size, x, y) for (r, g, b), level, size, x, y in steps]
            kind = owner
        else:
            # What was interpolated says nothing new: of every pixel the one colour that was measured.
            plate = sighting.light.rgb
            table = [
                (float(c == 0), float(c == 1), float(c == 2), plate[c], step[c], x, y)
                for step, _, _, x, y in steps
                for c in range(3)
            ]
            row, column = np.divmod(index, self._optics.width_px)
            kind = 3 * owner + channels[row & 1, column & 1]
        known = np.array(table).T.take(kind, axis=1)
        level, size = known[3:5]
        known[3:5] *= brightness
        pixels = sighting.image.reshape(-1, 3).take(index, axis=0)
        shown = pixels[:, 0] * known[0]
        shown += pixels[:, 1] * known[1]
        shown += pixels[:, 2] * known[2]
        shown -= level
        return shown, size, known[5:]

    def _scales(self, sighting: Sighting, seen: list[int], owner: NDArray[np.intp]) -> Array | float:
        """Return the scale from rays to pixels: of each disk's pixels where the lens is curved, else one for all."""
        if self._optics.ideal:
            return self._optics.mean_focal_px
        fit = sighting.fit
        scales = []
        for x, y, z in (self._layout.centers_m[seen] @ fit.R[:, :2].T + fit.p_m).tolist():
            _, _, ux, uy, vx, vy = self._optics.place(x / z, y / z)
            scales.append(math.sqrt(abs(ux * vy - uy * vx)))
        return np.array(scales).take(owner)


def _brightness_slope(light: PlateLight, predicted: MarkerImage) -> tuple[float, float]:
    """Return how the plate's brightness changes per pixel to the right and down."""
    a, b, c, d = predicted.plate_px
    scale = light.level / (a * d - b * c)
    slope_x, slope_y = light.slope
    return scale * (d * slope_x - c * slope_y), scale * (a * slope_y - b * slope_x)


def _step(light: PlateLight, relative: Color) -> tuple[Color, float, float]:
    """Return the step from the plate's to a disk's colour in units of brightness, the plate's colour along it, and its size."""
    red, green, blue = light.rgb
    x, y, z = (relative[0] - 1.0) * red, (relative[1] - 1.0) * green, (relative[2] - 1.0) * blue
    size = max(math.sqrt(x * x + y * y + z * z), _LEAST_STEP)
    return (x, y, z), (x * red + y * green + z * blue) / size, size
