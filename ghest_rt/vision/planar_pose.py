"""Poses of a plane from its homography: closed form, and there are two.

Seen from afar a plane tilted one way looks almost like the same plane tilted the other way. Both poses that agree with the
homography at the plate's centre to first order are found as in T. Collins and A. Bartoli, "Infinitesimal plane-based pose
estimation", IJCV 2014, section 4.
"""

import math

import cv2
import numpy as np

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array

Pose = tuple[Array, Array]
_PAIR_TOLERANCE = 0.1


def homography(plate_m: Array, rays: Array) -> Array:
    """Return the homography (3, 3) through four points of the plate (n, 2) and their rays, or the affine one through three."""
    source, target = plate_m.astype(np.float32), rays.astype(np.float32)
    if len(plate_m) == 4:
        return np.asarray(cv2.getPerspectiveTransform(source, target), dtype=np.float64)
    return np.vstack([cv2.getAffineTransform(source, target), (0.0, 0.0, 1.0)])


def facing_homography(plate_m: Array, rays: Array) -> Array:
    """Return the homography (3, 3) through two points, as if the plate faced the camera squarely."""
    plate = plate_m @ np.array([1.0, -1.0j])  # seen from the front, y is up in the plate and down in the image
    image = rays @ np.array([1.0, 1.0j])
    A = (image[0] - image[1]) / (plate[0] - plate[1])
    B = image[0] - A * plate[0]
    return np.array([[A.real, A.imag, B.real], [A.imag, -A.real, B.imag], [0.0, 0.0, 1.0]])


def pose_on_plane(theta: Array, plate_m: Array, rays: Array) -> Array | None:
    """Return the pose (4, 4) of a plate on a known plane from the rays (2, 2) through two of its points (2, 2).

    None if the points are not as far apart on the plane as on the plate.

    Args:
        theta: (3,) the plane theta . X = 1.
        plate_m: The points in the plate.
        rays: Their rays.
    """
    sight = np.column_stack([rays, np.ones(2)])
    points_m = sight / (sight @ theta)[:, None]
    along = points_m[0] - points_m[1]
    wanted = plate_m[0] - plate_m[1]
    length_m, wanted_m = float(np.linalg.norm(along)), float(np.linalg.norm(wanted))
    if abs(length_m / wanted_m - 1.0) > _PAIR_TOLERANCE or points_m[:, 2].min() <= 0.0:
        return None
    z = -theta / np.linalg.norm(theta)
    x = along / length_m
    y = _cross(z, x)
    c, s = wanted / wanted_m
    R = np.column_stack([c * x - s * y, s * x + c * y, z])
    return transform(R, points_m.mean(axis=0) - R[:, :2] @ plate_m.mean(axis=0))


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
        R = R_v @ np.column_stack([first, second, _cross(first, second)])
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


def _cross(a: Array, b: Array) -> Array:
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])
