"""The point that two moving bodies share: symmetrical centre of rotation estimation (SCoRE).

R. M. Ehrig, W. R. Taylor, G. N. Duda, M. O. Heller: "A survey of formal methods for determining the centre of rotation of ball
joints", Journal of Biomechanics 39 (2006) 2798-2809. Both centres at once, by least squares over all instants i:

    R_i g + p_i = S_i h + q_i        g in the first body (R, p), h in the second (S, q)

Robust: reweighted with Tukey's biweight, scaled by the residuals' median. The covariance is the sandwich estimate over
blocks of time: residuals within a block may be as much alike as they please (skin, mounts), those of different blocks are taken
as independent.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.errors import GhestError
from ghest_rt.geometry.so3 import Array

_ITERATIONS = 50
_TUKEY = 4.685  # 95 % as efficient as least squares where errors are normal
_NORMAL_NORM_MEDIAN = 1.5382  # median length of a standard normal vector in three dimensions
_LEAST_SCALE_M = 0.001  # skin and mounts do that much; nothing below eight times as much is an outlier
_CONVERGED_M = 1e-9
_LEAST_INSTANTS = 10
_LEAST_EIGENVALUE = 1e-6  # a spread of 0.08 degrees


class UnknowableCentreError(GhestError):
    """The two bodies have hardly turned against each other, or were hardly seen."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedCentre:
    """The centre in both bodies.

    Attributes:
        first_m: (3,) in the first body.
        second_m: (3,) in the second body.
        covariance: (6, 6) of (first, second), m^2.
        residual_m: (n, 3) by how much the two centres are apart at each instant, in the frame of the poses.
        used: (n,) the instants that count: those with weight.
        spread_rad: (3,) how far the bodies turned against each other, root mean square about three perpendicular axes,
            descending. With one axis alone the centre is unknown along it: the sum of the squares of the last two counts.
    """

    first_m: Array
    second_m: Array
    covariance: Array
    residual_m: Array
    used: NDArray[np.bool_]
    spread_rad: Array

    @property
    def turning_rad(self) -> float:
        """How far the bodies turned about other axes than the first: what the centre along that one rests on."""
        return float(np.hypot(self.spread_rad[1], self.spread_rad[2]))

    @property
    def first_sigma_m(self) -> float:
        """Standard deviation of the first centre in its worst direction."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[:3, :3])[-1]))

    @property
    def second_sigma_m(self) -> float:
        """Standard deviation of the second centre in its worst direction."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[3:, 3:])[-1]))

    @property
    def residual_rms_m(self) -> float:
        """Root mean square distance between the two centres over the instants that count."""
        return float(np.sqrt(np.mean(np.sum(self.residual_m[self.used] ** 2, axis=1))))


def find_centre(first: Array, second: Array, block: NDArray[np.int64]) -> SharedCentre:
    """Return the point that two bodies share.

    Args:
        first: (n, 4, 4) poses of the first body, metres.
        second: (n, 4, 4) poses of the second body at the same instants, in the same frame.
        block: (n,) number of the block of time that each instant belongs to.

    Raises:
        UnknowableCentreError: Fewer than ten instants, or no turning about a second axis.
    """
    count = len(first)
    if count < _LEAST_INSTANTS:
        raise UnknowableCentreError(f"both bodies are known together at {count} instants only")
    spread_rad, least = _spread(first, second)
    if least < _LEAST_EIGENVALUE:
        raise UnknowableCentreError("the bodies turn about one axis at most, so that the centre may be anywhere on it")
    A = np.concatenate((first[:, :3, :3], -second[:, :3, :3]), axis=2)
    b = second[:, :3, 3] - first[:, :3, 3]
    weights = np.ones(count)
    centres = np.zeros(6)
    for _ in range(_ITERATIONS):
        before = centres
        normal = np.einsum("nki,n,nkj->ij", A, weights, A)
        centres = np.linalg.solve(normal, np.einsum("nki,n,nk->i", A, weights, b))
        residual = b - A @ centres
        if np.abs(centres - before).max() < _CONVERGED_M:
            break
        length = np.linalg.norm(residual, axis=1)
        limit = _TUKEY * max(float(np.median(length)) / _NORMAL_NORM_MEDIAN, _LEAST_SCALE_M)
        # The length of three components is held against the limit of one: widened by the root of three.
        weights = np.square(np.clip(1.0 - np.square(length / (np.sqrt(3.0) * limit)), 0.0, None))
    return SharedCentre(
        first_m=centres[:3],
        second_m=centres[3:],
        covariance=_sandwich(A, weights, residual, block),
        residual_m=residual,
        used=weights > 0.0,
        spread_rad=spread_rad,
    )


def _spread(first: Array, second: Array) -> tuple[Array, float]:
    """Return the (3,) spread about each axis, and the least eigenvalue of the normal equations divided by the instants.

    That matrix is [[I, -M], [-M', I]] with M the mean of the relative rotation; its eigenvalues are 1 ± s, s the singular
    values of M. To second order 1 - s_1 is half the sum of the two lesser variances, and so on.
    """
    M = np.mean(np.swapaxes(first[:, :3, :3], 1, 2) @ second[:, :3, :3], axis=0)
    lack = np.sort(1.0 - np.linalg.svd(M, compute_uv=False))
    variances = np.clip(lack.sum() - 2.0 * lack, 0.0, None)
    return np.sqrt(np.sort(variances)[::-1]), float(lack[0])


def _sandwich(A: Array, weights: Array, residual: Array, block: NDArray[np.int64]) -> Array:
    """Return the covariance of weighted least squares whose residuals are alike within blocks."""
    bread = np.linalg.inv(np.einsum("nki,n,nkj->ij", A, weights, A))
    scores = np.einsum("nki,n,nk->ni", A, weights, residual)
    names = np.unique(block)
    sums = np.array([scores[block == name].sum(axis=0) for name in names])
    more = len(names) / max(len(names) - A.shape[2], 1)  # residuals are smaller than errors, by the six numbers fitted
    return np.asarray(more * bread @ sums.T @ sums @ bread)
