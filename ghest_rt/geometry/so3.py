"""Rotations SO(3): (3, 3) float64 matrices, rotation vectors in radians, unit quaternions (w, x, y, z).

Formulas after J. Solà et al., "A micro Lie theory for state estimation in robotics", 2018, eq. (132)-(146).
"""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SMALL_RAD = 1e-7


def skew(v: Array) -> Array:
    """Return the (3, 3) matrix [v]x with [v]x w = v x w."""
    x, y, z = v.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exp_so3(rotvec_rad: Array) -> Array:
    """Return the rotation matrix of a rotation vector (Rodrigues)."""
    x, y, z = rotvec_rad.tolist()
    return rotation(x, y, z)


def rotation(x: float, y: float, z: float) -> Array:
    """Return `exp_so3` of a rotation vector given by its components, rad."""
    angle2 = x * x + y * y + z * z
    angle = math.sqrt(angle2)
    if angle < _SMALL_RAD:
        a, b = 1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0
    else:
        a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle2
    bxy, bxz, byz = b * x * y, b * x * z, b * y * z
    return np.array(
        [
            [1.0 - b * (y * y + z * z), bxy - a * z, bxz + a * y],
            [bxy + a * z, 1.0 - b * (x * x + z * z), byz - a * x],
            [bxz - a * y, byz + a * x, 1.0 - b * (x * x + y * y)],
        ]
    )


def log_so3(R: Array) -> Array:
    """Return the rotation vector of a rotation matrix, angle in [0, pi]."""
    w, x, y, z = quat_wxyz(R)
    sine = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 / w if sine < _SMALL_RAD else 2.0 * math.atan2(sine, w) / sine
    return np.array([factor * x, factor * y, factor * z])


def angle_between_rad(R_a: Array, R_b: Array) -> float:
    """Return the angle of the rotation R_a R_b^-1, in [0, pi] (the norm of the paper's exponential map error, 3.4.2)."""
    return float(np.linalg.norm(log_so3(R_a @ R_b.T)))


def quat_wxyz_from_matrix(R: Array) -> Array:
    """Return the unit quaternion (w, x, y, z) with w >= 0 (Shepperd's method: no cancellation anywhere)."""
    return np.array(quat_wxyz(R))


def quat_wxyz(R: Array) -> tuple[float, float, float, float]:
    """Return `quat_wxyz_from_matrix` as plain numbers."""
    (m00, m01, m02), (m10, m11, m12), (m20, m21, m22) = R.tolist()
    trace = m00 + m11 + m22
    largest = max(trace, m00, m11, m22)
    if largest == trace:
        q = (1.0 + trace, m21 - m12, m02 - m20, m10 - m01)
    elif largest == m00:
        q = (m21 - m12, 1.0 + m00 - m11 - m22, m01 + m10, m02 + m20)
    elif largest == m11:
        q = (m02 - m20, m01 + m10, 1.0 + m11 - m00 - m22, m12 + m21)
    else:
        q = (m10 - m01, m02 + m20, m12 + m21, 1.0 + m22 - m00 - m11)
    norm = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    if q[0] < 0.0:
        norm = -norm
    return q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm


def matrix_from_quat_wxyz(q: Array) -> Array:
    """Return the rotation matrix of a quaternion (w, x, y, z), normalised first."""
    w, x, y, z = (float(v) for v in q / np.linalg.norm(q))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def slerp(R_0: Array, R_1: Array, fraction: float) -> Array:
    """Return the rotation a `fraction` of the way along the geodesic from R_0 to R_1 (beyond [0, 1] it extrapolates)."""
    return R_0 @ exp_so3(fraction * log_so3(R_0.T @ R_1))


def nearest_rotation(M: Array) -> Array:
    """Return the rotation nearest to a (3, 3) matrix in the Frobenius norm."""
    U, _, Vt = np.linalg.svd(M)
    D = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(U @ Vt)))])
    return np.asarray(U @ D @ Vt, dtype=np.float64)


def rot_x(angle_rad: float) -> Array:
    """Return the rotation about x."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rot_y(angle_rad: float) -> Array:
    """Return the rotation about y."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rot_z(angle_rad: float) -> Array:
    """Return the rotation about z."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
