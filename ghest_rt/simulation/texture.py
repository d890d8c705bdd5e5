"""What is printed on a marker plate: the paper's four disks, or an ArUco code of the same outer size for comparison."""

from typing import Literal, Protocol

import cv2
import numpy as np

from ghest_rt.config.station import Marker
from ghest_rt.geometry.so3 import Array

MarkerTexture = Literal["disks", "aruco"]

_WHITE = (236.0, 236.0, 233.0)
_BLACK = (18.0, 18.0, 20.0)
_ARUCO_IDS = {"m0": 0, "m1": 1}


class Texture(Protocol):
    """Colour of a plate as a function of plate coordinates (metres, marker frame)."""

    def colors(self, x_m: Array, y_m: Array) -> Array:
        """Return the (n, 3) colours 0-255 at (n,) points on the plate."""
        ...

    def edge_distance_m(self, x_m: Array, y_m: Array) -> Array:
        """Return how far each point is from the nearest change of colour, at least approximately."""
        ...


class DiskTexture:
    """Four coloured disks on white, eq. (5): p0 (+a,-a), p1 (-a,-a), p2 (+a,+a), p3 (-a,+a)."""

    def __init__(self, marker: Marker) -> None:
        self._a = marker.half_spacing_m
        self._r = marker.disk_radius_m
        # Indexed by (x > 0) + 2 * (y > 0): p1, p0, p3, p2; then white.
        p0, p1, p2, p3 = marker.disk_rgb
        self._palette = np.array((p1, p0, p3, p2, _WHITE), dtype=np.float64)

    def colors(self, x_m: Array, y_m: Array) -> Array:
        """See `Texture`."""
        index = (x_m > 0) + 2 * (y_m > 0)
        index[self._from_rim_m(x_m, y_m) > 0] = 4
        return np.asarray(self._palette[index])

    def edge_distance_m(self, x_m: Array, y_m: Array) -> Array:
        """See `Texture`; exact."""
        return np.abs(self._from_rim_m(x_m, y_m))

    def _from_rim_m(self, x_m: Array, y_m: Array) -> Array:
        return np.hypot(np.abs(x_m) - self._a, np.abs(y_m) - self._a) - self._r


class ArucoTexture:
    """An ArUco code of DICT_4X4_50 on white: id 0 for m0, 1 for m1.

    The black square's side is twice (half spacing + disk radius), the outer size of the disks. The code image's top left corner
    is at (-side/2, +side/2) of the marker frame, its rows run along +x.
    """

    def __init__(self, marker: Marker, name: str) -> None:
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        self._bits = np.asarray(cv2.aruco.generateImageMarker(dictionary, _ARUCO_IDS[name], 6)) > 127
        self._side = 2.0 * (marker.half_spacing_m + marker.disk_radius_m)
        self._palette = np.array((_BLACK, _WHITE))

    def colors(self, x_m: Array, y_m: Array) -> Array:
        """See `Texture`."""
        column = np.floor((x_m / self._side + 0.5) * 6).astype(np.intp)
        row = np.floor((0.5 - y_m / self._side) * 6).astype(np.intp)
        inside = (column >= 0) & (column < 6) & (row >= 0) & (row < 6)
        white = np.ones(x_m.shape, dtype=np.intp)
        white[inside] = self._bits[row[inside], column[inside]]
        return np.asarray(self._palette[white])

    def edge_distance_m(self, x_m: Array, y_m: Array) -> Array:
        """See `Texture`; the distance to the nearest line between cells."""
        cell = self._side / 6
        x, y = np.abs(x_m) / cell, np.abs(y_m) / cell
        near_x = np.where(x > 3, x - 3, np.abs(x - np.rint(x)))
        near_y = np.where(y > 3, y - 3, np.abs(y - np.rint(y)))
        return np.asarray(
            np.where((x > 3) | (y > 3), np.maximum(near_x * (x > 3), near_y * (y > 3)), np.minimum(near_x, near_y)) * cell
        )


def make_texture(kind: MarkerTexture, marker: Marker, name: str) -> Texture:
    """Return the texture of marker `name`."""
    return DiskTexture(marker) if kind == "disks" else ArucoTexture(marker, name)
