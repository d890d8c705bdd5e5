"""Poses of a plane from its homography: closed form, and there are two.

Seen from afar a plane tilted one way looks almost like the same plane tilted the other way. Both poses that agree with the
homography at the plate's centre to first order are found as in T. Collins and A. Bartoli, "Infinitesimal plane-based pose
estimation", IJCV 2014, section 4.
"""

import math

import numpy as np

from ghest_rt.geometry.so3 import Array

Pose = tuple[Array, Array]


def poses_of_homography(H: Array) -> tuple[Pose, Pose] | None:
    """Return two poses (R (3, 3), p_m (3,)) of a plate from its homography, plate metres to rays; None if it is degenerate.

    Args:
        H: (3, 3); the plate's origin must be before the camera.
    """
    if abs(H[2, 2]) < 1e-12:
        return None
    H = H / H[2, 2]
    x, y = float(H[0, 2]), float(H[1, 2])
    J = H[:2, :2] - np.outer((x, y), H[2, :2])
    R_v = _rotation_to((x, y, 1.0))
    B = R_v[:2, :2] - np.outer((x, y), R_v[2, :2])
    try:
        A = np.linalg.solve(B, J)
    except np.linalg.LinAlgError:
        return None
    squares = float((A * A).sum())
    determinant = float(A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0])
    scale = math.sqrt(0.5 * (squares + math.sqrt(max(squares * squares - 4.0 * determinant * determinant, 0.0))))
    if scale < 1e-12:
        return None
    upper = A / scale
    rest = np.eye(2) - upper.T @ upper
    b0 = math.sqrt(max(float(rest[0, 0]), 0.0))
    b1 = math.copysign(math.sqrt(max(float(rest[1, 1]), 0.0)), float(rest[0, 1]))
    p_m = np.array([x, y, 1.0]) / scale
    poses = []
    for sign in (1.0, -1.0):
        first = np.array([upper[0, 0], upper[1, 0], sign * b0])
        second = np.array([upper[0, 1], upper[1, 1], sign * b1])
        first /= np.linalg.norm(first)
        second -= first * (first @ second)
        second /= np.linalg.norm(second)
        R = R_v @ np.column_stack([first, second, np.cross(first, second)])
        poses.append((R, p_m))
    return poses[0], poses[1]


def mirrored(R: Array, p_m: Array) -> Array:
    """Return the rotation of the other pose that looks almost the same: the normal mirrored about the line of sight."""
    sight = p_m / np.linalg.norm(p_m)
    # Reflecting the plate through the plane across the line of sight flips depth; flipping z once more makes it a rotation.
    mirror = np.eye(3) - 2.0 * np.outer(sight, sight)
    return mirror @ R @ np.diag([1.0, 1.0, -1.0])


def _rotation_to(v: tuple[float, float, float]) -> Array:
    """Return the shortest rotation that takes the z axis into the direction of v (v_z > 0)."""
    length = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    x, y, z = v[0] / length, v[1] / length, v[2] / length
    k = 1.0 / (1.0 + z)
    return np.array([[1.0 - x * x * k, -x * y * k, x], [-x * y * k, 1.0 - y * y * k, y], [-x, -y, z]])
