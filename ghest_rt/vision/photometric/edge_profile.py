"""How much of a pixel a straight edge covers, the lens' blur included.

A square pixel seen along the edge's normal (cos t, sin t) weighs the light by a trapezoid: the convolution of boxes as wide as
|cos t| and |sin t|, of variance 1/12 whatever t. A Gaussian blur of standard deviation b comes on top. With G the second
integral of the Gaussian's distribution function, G(x) = ((x^2 + b^2) Phi(x / b) + x b phi(x / b)) / 2,

    coverage(-s) = (G(s + h) - G(s + k) - G(s - k) + G(s - h)) / |cos t sin t|,    h, k = (|cos t| +- |sin t|) / 2,

s being the distance from the pixel's middle to the edge, positive outside. Tabulated, since a table is quicker than arithmetic.
"""

import math
from functools import lru_cache

import numpy as np

from ghest_rt.geometry.so3 import Array

REACH_PX = 4.0
_BLURS_APART_PX = 0.08
BLURS_PX = tuple(round(_BLURS_APART_PX * k, 2) for k in range(1, 15))
PIXEL_VARIANCE = 1.0 / 12.0
_STEPS_PER_PX = 128
_DIRECTIONS = 12
_LEAST_SIDE = 0.02  # a box narrower than this is as good as none, and would divide by nothing
_BLUR_STEP_PX = 0.01
_GRID = np.linspace(-8.0, 8.0, 8001)
_PHI = np.array([0.5 * math.erfc(-z / math.sqrt(2.0)) for z in _GRID.tolist()])


class EdgeProfile:
    """Tables of coverage and its derivatives for one blur.

    Args:
        blur_px: Standard deviation of the blur.
    """

    def __init__(self, blur_px: float) -> None:
        self.blur_px = blur_px
        covered = _coverage(blur_px)
        # [coverage, d coverage / d s, d coverage / d blur] per (distance, direction)
        slope = np.gradient(covered, 1.0 / _STEPS_PER_PX, axis=0)
        widening = (_coverage(blur_px + _BLUR_STEP_PX) - _coverage(blur_px - _BLUR_STEP_PX)) / (2 * _BLUR_STEP_PX)
        self._table = np.stack([covered.ravel(), slope.ravel(), widening.ravel()])

    def __call__(self, distance_px: Array, half_sine2: Array) -> Array:
        """Return (3, n): coverage, its derivative by distance, its derivative by blur.

        Args:
            distance_px: (n,) distance of pixels from the edge, positive outside; within `REACH_PX`.
            half_sine2: (n,) |sin 2t| / 2 = |cos t sin t| of the direction t of the edge's normal.
        """
        steps = distance_px * _STEPS_PER_PX
        steps += REACH_PX * _STEPS_PER_PX + 0.5
        place = steps.astype(np.intp)
        place *= _DIRECTIONS
        np.multiply(half_sine2, 2.0 * (_DIRECTIONS - 1), out=steps)
        steps += 0.5
        place += steps.astype(np.intp)
        return self._table.take(place, axis=1, mode="clip")


def profile_of(blur_px: float) -> EdgeProfile:
    """Return the profile whose blur comes nearest."""
    return _profile_at(min(max(round(blur_px / _BLURS_APART_PX) - 1, 0), len(BLURS_PX) - 1))


@lru_cache(maxsize=len(BLURS_PX))
def _profile_at(index: int) -> EdgeProfile:
    return EdgeProfile(BLURS_PX[index])


def _coverage(blur_px: float) -> Array:
    """Return (distances, directions) coverage."""
    s = -np.linspace(-REACH_PX, REACH_PX, round(2 * REACH_PX * _STEPS_PER_PX) + 1)
    half_angle = 0.5 * np.arcsin(np.linspace(0.0, 1.0, _DIRECTIONS))
    wide, narrow = np.cos(half_angle), np.maximum(np.sin(half_angle), _LEAST_SIDE)
    h, k = 0.5 * (wide + narrow), 0.5 * (wide - narrow)
    x = s[:, None]
    second = _second_integral(x + h, blur_px) - _second_integral(x + k, blur_px)
    second += _second_integral(x - h, blur_px) - _second_integral(x - k, blur_px)
    return np.asarray(np.clip(second / (wide * narrow), 0.0, 1.0), dtype=np.float64)


def _second_integral(x: Array, blur_px: float) -> Array:
    z = x / blur_px
    phi = np.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    return np.asarray(0.5 * ((x * x + blur_px * blur_px) * _normal_distribution(z) + x * blur_px * phi), dtype=np.float64)


def _normal_distribution(z: Array) -> Array:
    return np.asarray(np.interp(z, _GRID, _PHI), dtype=np.float64)
