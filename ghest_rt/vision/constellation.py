"""Which coloured spots are the marker's disks: the choice that fits its colours and its geometry.

Everything compared is unchanged by an affine map, as a small plate's image nearly is: opposite sides of the square equal,
the disks' area as a share of the square's, and the order p0, p1, p3, p2 running clockwise in the image.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.config.station import COLOR_REACH
from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.color_blobs import Blobs
from ghest_rt.vision.disk_centers import Color
from ghest_rt.vision.layout import PLATE_LEVEL, MarkerLayout
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.planar_pose import facing_homography, homography

_PER_COLOR = 4
_SKEW = 0.3  # difference of opposite sides, over the mean side
_AREA_LOW, _AREA_HIGH = 0.55, 1.7
_PAIR_LOW, _PAIR_HIGH = 0.65, 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Constellation:
    """The marker's disks among the spots.

    Attributes:
        H: (3, 3) homography from the plate (metres) to rays; affine if only three disks were found, and of a plate facing the
            camera squarely if two.
        seen: Which disks were found.
        rays: (n, 2) rays through their centres.
        relative: Colours of p0..p3 relative to the plate's; the nominal ones where a disk was not found.
    """

    H: Array
    seen: list[int]
    rays: Array
    relative: list[Color]


class ConstellationFinder:
    """Chooses one spot per disk colour."""

    def __init__(self, layout: MarkerLayout, optics: Optics) -> None:
        self._layout = layout
        self._optics = optics
        self._nominal = layout.disk_rgb / PLATE_LEVEL
        self._chroma = self._nominal / self._nominal.sum(axis=1, keepdims=True)
        side_m = 2.0 * np.abs(layout.centers_m).max()
        self._area_share = math.pi * layout.radius_m**2 / side_m**2

    def find(self, blobs: Blobs) -> Constellation | None:
        """Return the best choice of four spots, else of three, else of two, or None if none makes a marker."""
        chroma = blobs.relative / np.maximum(blobs.relative.sum(axis=1, keepdims=True), 1e-6)
        distance = np.linalg.norm(chroma[None] - self._chroma[:, None], axis=2)
        candidates = []
        for k in range(4):
            order = np.argsort(distance[k])[:_PER_COLOR]
            candidates.append([int(b) for b in order if distance[k, b] < COLOR_REACH and distance[:, b].argmin() == k])
        places = blobs.centers_px.tolist()
        areas = blobs.areas_px.tolist()
        best: tuple[float, tuple[int | None, ...]] | None = None
        for choice in itertools.product(*candidates):
            cost = self._square_cost([places[b] for b in choice], [areas[b] for b in choice])
            if cost is not None:
                cost += sum(float(distance[k, b]) for k, b in enumerate(choice))
                if best is None or cost < best[0]:
                    best = (cost, choice)
        if best is None:
            for hidden in range(4):
                others = [k for k in range(4) if k != hidden]
                for picked in itertools.product(*(candidates[k] for k in others)):
                    cost = self._corner_cost(hidden, [places[b] for b in picked], [areas[b] for b in picked])
                    if cost is not None:
                        cost += sum(float(distance[k, b]) for k, b in zip(others, picked, strict=True))
                        if best is None or cost < best[0]:
                            row = iter(picked)
                            best = (cost, tuple(None if k == hidden else next(row) for k in range(4)))
        if best is None:
            for one, other in itertools.combinations(range(4), 2):
                for a, b in itertools.product(candidates[one], candidates[other]):
                    cost = self._pair_cost(one, other, math.dist(places[a], places[b]), areas[a] * areas[b])
                    if cost is not None:
                        cost += float(distance[one, a] + distance[other, b])
                        if best is None or cost < best[0]:
                            best = (cost, tuple(a if k == one else b if k == other else None for k in range(4)))
        return None if best is None else self._constellation(best[1], blobs)

    def _square_cost(self, points: list[list[float]], areas: list[float]) -> float | None:
        """How far four spots p0..p3 are from a parallelogram with disks of the right size; None if too far."""
        (x0, y0), (x1, y1), (x2, y2), (x3, y3) = points
        ax, ay, bx, by = (
            0.5 * (x0 - x1 + x2 - x3),
            0.5 * (y0 - y1 + y2 - y3),
            0.5 * (x2 - x0 + x3 - x1),
            0.5 * (y2 - y0 + y3 - y1),
        )
        square = ay * bx - ax * by  # positive if seen from the front
        side = math.sqrt(max(ax * ax + ay * ay, bx * bx + by * by))
        if square <= 0.1 * side * side:
            return None
        skew = math.hypot(x0 + x3 - x1 - x2, y0 + y3 - y1 - y2) / (2.0 * side)
        if skew > _SKEW:
            return None
        return self._area_cost(areas, square, skew)

    def _corner_cost(self, hidden: int, points: list[list[float]], areas: list[float]) -> float | None:
        """The same for three spots; the fourth is where it completes the parallelogram."""
        row = iter(points)
        full = [[0.0, 0.0] if k == hidden else next(row) for k in range(4)]
        opposite, one, other = 3 - hidden, *(k for k in range(4) if k not in (hidden, 3 - hidden))
        full[hidden] = [full[one][c] + full[other][c] - full[opposite][c] for c in range(2)]
        return self._square_cost(full, areas)

    def _pair_cost(self, one: int, other: int, apart_px: float, areas_product: float) -> float | None:
        """How far two spots are from the right distance for their size; None if too far, tilts considered."""
        apart_m = math.dist(self._layout.centers_m[one], self._layout.centers_m[other])
        ratio = apart_px / apart_m * self._layout.radius_m * math.sqrt(math.pi) / areas_product**0.25
        return None if not _PAIR_LOW < ratio < _PAIR_HIGH else abs(math.log(ratio))

    def _area_cost(self, areas: list[float], square: float, skew: float) -> float | None:
        cost = skew
        for area in areas:
            ratio = area / (self._area_share * square)
            if not _AREA_LOW < ratio < _AREA_HIGH:
                return None
            cost += 0.3 * abs(math.log(ratio))
        return cost

    def _constellation(self, choice: tuple[int | None, ...], blobs: Blobs) -> Constellation:
        seen = [k for k in range(4) if choice[k] is not None]
        picked = [b for b in choice if b is not None]
        rays = self._optics.disk_rays(blobs.centers_px[picked], np.zeros((len(picked), 1)))
        plate_m = self._layout.centers_m[seen]
        H = facing_homography(plate_m, rays) if len(seen) == 2 else homography(plate_m, rays)
        relative = self._nominal.copy()
        relative[seen] = blobs.relative[picked]
        return Constellation(H, seen, rays, [(red, green, blue) for red, green, blue in relative.tolist()])
