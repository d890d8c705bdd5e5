"""Algebra of small matrices: at this size what a call into numpy.linalg checks costs more than the arithmetic."""

import math

import cv2
import numpy as np

from ghest_rt.geometry.so3 import Array


def inverse_3(M: Array) -> Array:
    """Return the inverse of a regular (3, 3) matrix by its cofactors."""
    (a, b, c), (d, e, f), (g, h, i) = M.tolist()
    A, B, C = e * i - f * h, f * g - d * i, d * h - e * g
    k = 1.0 / (a * A + b * B + c * C)
    return np.array(
        [
            [k * A, k * (c * h - b * i), k * (b * f - c * e)],
            [k * B, k * (a * i - c * g), k * (c * d - a * f)],
            [k * C, k * (b * g - a * h), k * (a * e - b * d)],
        ]
    )


def inverse_spd(M: Array) -> Array:
    """Return the inverse of a positive definite (n, n) matrix, by Cholesky's factors; by LU if rounding spoils them."""
    positive, inverse = cv2.invert(M, flags=cv2.DECOMP_CHOLESKY)
    return np.asarray(inverse if positive else np.linalg.inv(M), dtype=np.float64)


def whitened_3(covariance: Array, v: Array) -> Array:
    """Return L^-1 v with L the lower Cholesky factor of a positive definite (3, 3) covariance: (3,) of unit covariance."""
    (a, _, _), (b, c, _), (d, e, f) = covariance.tolist()
    x, y, z = v.tolist()
    l_00 = math.sqrt(a)
    l_10, l_20 = b / l_00, d / l_00
    l_11 = math.sqrt(c - l_10 * l_10)
    l_21 = (e - l_20 * l_10) / l_11
    l_22 = math.sqrt(f - l_20 * l_20 - l_21 * l_21)
    u = x / l_00
    w = (y - l_10 * u) / l_11
    return np.array([u, w, (z - l_20 * u - l_21 * w) / l_22])
