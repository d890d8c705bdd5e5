"""The marker's geometry as arrays, in the marker frame (docs/frames.md), metres."""

from dataclasses import dataclass

import numpy as np

from ghest_rt.config.station import Marker
from ghest_rt.geometry.so3 import Array

# Disks p0..p3 stand at these multiples of the half spacing a: the order that eq. (5) takes for granted.
DISK_SIGNS = np.array([[1.0, -1.0], [-1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
_WHITE_GRID = 9
# What a channel of a white plate reads in the light under which the nominal colours are given.
PLATE_LEVEL = 238.0


@dataclass(frozen=True, slots=True, eq=False)
class MarkerLayout:
    """A square plate with one coloured disk per corner.

    Attributes:
        centers_m: (4, 2) disk centres p0..p3 in the plate.
        radius_m: Radius of the disks.
        half_plate_m: Half the side of the plate.
        white_m: (n, 2) points of the plate that are surely white, evenly spread.
        corners_m: (4, 2) corners of the plate, in order around it.
        disk_rgb: (4, 3) nominal colours of p0..p3.
    """

    centers_m: Array
    radius_m: float
    half_plate_m: float
    white_m: Array
    corners_m: Array
    disk_rgb: Array

    @staticmethod
    def of(marker: Marker) -> "MarkerLayout":
        """Return the layout of a marker of the station file."""
        centers_m = marker.half_spacing_m * DISK_SIGNS
        half_m = marker.plate_m / 2
        margin_m = 0.3 * marker.disk_radius_m
        line_m = np.linspace(-half_m + margin_m, half_m - margin_m, _WHITE_GRID)
        grid_m = np.stack(np.meshgrid(line_m, line_m), axis=-1).reshape(-1, 2)
        clear_m = np.linalg.norm(grid_m[:, None] - centers_m, axis=2).min(axis=1)
        return MarkerLayout(
            centers_m=centers_m,
            radius_m=marker.disk_radius_m,
            half_plate_m=half_m,
            white_m=grid_m[clear_m > marker.disk_radius_m + margin_m],
            corners_m=half_m * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
            disk_rgb=np.array(marker.disk_rgb, dtype=np.float64),
        )
