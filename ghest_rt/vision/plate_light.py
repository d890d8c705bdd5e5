"""The light on the marker: the white plate's colour in this image and how brightness changes across it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.optics import Optics

_OUTLIER = 0.12  # relative brightness beside the fitted plane
_MIN_SAMPLES = 8
_MIN_LEVEL = 24.0  # sum of the three channels below which the plate is too dark to be told from anything


@dataclass(frozen=True, slots=True, eq=False)
class PlateLight:
    """Brightness of the white plate: s(X, Y) = level (1 + slope . (X, Y)), colour s * rgb.

    Attributes:
        level: Sum of the three channels at the plate's centre.
        slope: (2,) relative change of brightness per metre along the plate's axes.
        rgb: (3,) colour of the plate, summing to one.
        clear: Share of the samples that look like the plate: less than one where something covers it.
    """

    level: float
    slope: Array
    rgb: Array
    clear: float


class PlateSampler:
    """Reads the plate's colour at fixed points between and around the disks."""

    def __init__(self, layout: MarkerLayout, optics: Optics) -> None:
        self._optics = optics
        self._points = np.vstack([layout.white_m.T, np.ones(len(layout.white_m))])
        self._design = np.column_stack([np.ones(len(layout.white_m)), layout.white_m])
        self._solve = np.linalg.pinv(self._design)

    def __call__(self, image: NDArray[np.uint8], H: Array) -> PlateLight | None:
        """Return the light on the plate that homography H (3, 3) puts into the image; None where no plate is to be seen."""
        points = H @ self._points
        pixels = np.rint(self._optics.pixels((points[:2] / points[2]).T)).astype(np.intp)
        u, v = pixels[:, 0], pixels[:, 1]
        inside = None
        if u.min() < 0 or v.min() < 0 or u.max() >= self._optics.width_px or v.max() >= self._optics.height_px:
            inside = (u >= 0) & (v >= 0) & (u < self._optics.width_px) & (v < self._optics.height_px)
            u, v = u[inside], v[inside]
        if len(u) < _MIN_SAMPLES:
            return None
        rgb = image[v, u].astype(np.float64)
        sums = rgb.sum(axis=1)
        design = self._design if inside is None else self._design[inside]
        plane = self._solve @ sums if inside is None else np.linalg.lstsq(design, sums, rcond=None)[0]
        good = np.abs(sums - design @ plane) < _OUTLIER * abs(plane[0])
        if not good.all():
            good = np.abs(sums - np.median(sums)) < 2 * _OUTLIER * np.median(sums)
            if good.sum() < _MIN_SAMPLES:
                return None
            plane = np.linalg.lstsq(design[good], sums[good], rcond=None)[0]
            good = np.abs(sums - design @ plane) < _OUTLIER * abs(plane[0])
            if good.sum() < _MIN_SAMPLES:
                return None
            plane = np.linalg.lstsq(design[good], sums[good], rcond=None)[0]
            rgb = rgb[good]
        if plane[0] < _MIN_LEVEL:
            return None
        mean = rgb.mean(axis=0)
        return PlateLight(float(plane[0]), plane[1:] / plane[0], mean / mean.sum(), float(good.mean()))
