"""Rigid transforms SE(3) as (4, 4) float64 matrices, metres. `a_from_b @ b_from_c` is `a_from_c`."""

import numpy as np
from numpy.typing import ArrayLike

from ghest_rt.geometry.so3 import Array, slerp

_EYE = np.eye(4)


def transform(R: Array, p_m: ArrayLike) -> Array:
    """Return the transform with rotation R (3, 3) and translation p_m (3,)."""
    T = _EYE.copy()
    T[:3, :3] = R
    T[:3, 3] = p_m
    return T


def inverse(T: Array) -> Array:
    """Return the inverse of a rigid transform."""
    out = _EYE.copy()
    R_t = T[:3, :3].T
    out[:3, :3] = R_t
    out[:3, 3] = -R_t.dot(T[:3, 3])
    return out


def interpolate(T_0: Array, T_1: Array, fraction: float) -> Array:
    """Return the transform `fraction` of the way: rotation along the geodesic, translation along the chord."""
    return transform(slerp(T_0[:3, :3], T_1[:3, :3], fraction), (1.0 - fraction) * T_0[:3, 3] + fraction * T_1[:3, 3])


def rigidity_problem(T: Array, tolerance: float = 1e-6) -> str | None:
    """Say why a (4, 4) matrix is not a rigid transform, or return None if it is one."""
    if T.shape != (4, 4):
        return f"has shape {T.shape}, not (4, 4)"
    if not np.isfinite(T).all():
        return "holds a number that is not finite"
    if np.abs(T[3] - (0.0, 0.0, 0.0, 1.0)).max() > tolerance:
        return "has a last row that is not 0 0 0 1"
    R = T[:3, :3]
    off = float(np.abs(R.T @ R - np.eye(3)).max())
    if off > tolerance:
        return f"is not rigid: its columns are not orthonormal (by {off:.2g})"
    if np.linalg.det(R) < 0:
        return "is a mirror image (determinant -1), not a rotation"
    return None
