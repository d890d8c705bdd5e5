"""The light on the marker: the white plate's colour in this image and how brightness changes across it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.optics import Optics

_OUTLIER = 0.12  # relative brightness beside the fitted plane
_MIN_SAMPLES = 8
_CLIPPED = 251.0
_ONES = np.ones(3)
_MIN_LEVEL = 24.0  # sum of the three channels below which the plate is too dark to be told from anything


@dataclass(frozen=True, slots=True, eq=False)
class PlateLight:
    """Brightness of the white plate: s(X, Y) = level (1 + slope . (X, Y)), colour s * rgb.

    Attributes:
        level: Sum of the three channels at the plate's centre.
        slope: Relative change of brightness per metre along the plate's axes.
        rgb: Colour of the plate, summing to one.
    """

    level: float
    slope: tuple[float, float]
    rgb: tuple[float, float, float]

    @property
    def clipped(self) -> bool:
        """Whether the plate is so bright that a channel reaches the end of its scale, where mixtures are no longer linear."""
        return self.level * max(self.rgb) > _CLIPPED


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
        places = self._optics.pixels((points[:2] / points[2]).T)
        design, solve = self._design, self._solve
        width, height = self._optics.width_px, self._optics.height_px
        u, v = np.rint(places.T).astype(np.intp)
        if u.view(np.uintp).max() >= width or v.view(np.uintp).max() >= height:  # what is negative is huge without its sign
            inside = (u >= 0) & (v >= 0) & (u < width) & (v < height)
            if np.count_nonzero(inside) < _MIN_SAMPLES:
                return None
            u, v, design = u[inside], v[inside], design[inside]
            solve = np.linalg.pinv(design)
        rgb = image.reshape(-1, 3).take(v * width + u, axis=0).astype(np.float64)
        sums = rgb @ _ONES
        plane = solve @ sums
        off = np.abs(sums - design @ plane)
        if not float(off.max()) < _OUTLIER * abs(float(plane[0])):
            middle = np.median(sums)
            good = np.abs(sums - middle) < 2 * _OUTLIER * middle
            for _ in range(2):
                if np.count_nonzero(good) < _MIN_SAMPLES:
                    return None
                plane = np.linalg.lstsq(design[good], sums[good], rcond=None)[0]
                last, good = good, np.abs(sums - design @ plane) < _OUTLIER * abs(plane[0])
            rgb = rgb[last]
        level, slope_x, slope_y = plane.tolist()
        if level < _MIN_LEVEL:
            return None
        red, green, blue = np.add.reduce(rgb, axis=0).tolist()
        total = red + green + blue
        return PlateLight(level, (slope_x / level, slope_y / level), (red / total, green / total, blue / total))
