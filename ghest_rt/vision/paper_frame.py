"""Step (3) of the paper's 3.3.1, eq. (4) and (5): the marker frame from its four disk centres."""

import numpy as np

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, nearest_rotation


def origin_eq4(points_m: Array) -> Array:
    """Eq. (4): the marker's origin, the mean of the disk centres (n, 3)."""
    return np.asarray(points_m.mean(axis=0), dtype=np.float64)


def axes_eq5(points_m: Array) -> Array | None:
    """Eq. (5): the marker's axes from its disk centres p0..p3 (4, 3), as columns of a (3, 3) rotation.

    The unit vectors are normalised to SO(3) by taking the nearest rotation. None if the points do not span a plane.
    """
    p0, p1, p2, p3 = points_m
    V_x = 0.5 * ((p0 - p1) + (p2 - p3))
    V_y = 0.5 * ((p2 - p0) + (p3 - p1))
    V_z = np.cross(V_x, V_y)
    lengths = np.linalg.norm([V_x, V_y, V_z], axis=1)
    if lengths[2] <= 1e-3 * lengths[0] * lengths[1] or not lengths[2]:
        return None
    return nearest_rotation(np.column_stack([V_x / lengths[0], V_y / lengths[1], V_z / lengths[2]]))


def marker_frame(points_m: Array) -> Array | None:
    """Return T_m^r (4, 4) of eq. (4) and (5) from p0..p3 (4, 3) in the camera frame; None if they do not span a plane."""
    axes = axes_eq5(points_m)
    return None if axes is None else transform(axes, origin_eq4(points_m))
