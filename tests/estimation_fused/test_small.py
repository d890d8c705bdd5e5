"""Small matrices: as a linear algebra library has it, the awkward ones too."""

import numpy as np
import pytest

from ghest_rt.estimation.fused.small import inverse_3, inverse_spd, whitened_3
from ghest_rt.geometry.so3 import Array

_RNG = np.random.default_rng(5)


def _covariance(size: int, *, scales: float = 1.0) -> Array:
    root = _RNG.normal(size=(size, size))
    scale = np.logspace(0.0, -scales, size)
    return np.asarray(scale[:, None] * (root @ root.T + 0.1 * np.eye(size)) * scale)


@pytest.mark.parametrize("size", [3, 6, 13])
@pytest.mark.parametrize("scales", [0.0, 4.0, 7.0])  # metres beside what is not known: variances differ by 10^14
def test_the_inverse_of_a_covariance_holds_whatever_its_units(size: int, scales: float) -> None:
    S = _covariance(size, scales=scales)
    units = 1.0 / np.sqrt(S.diagonal())
    identity = (S @ inverse_spd(S)) * units[:, None] / units
    np.testing.assert_allclose(identity, np.eye(size), atol=1e-9)


def test_a_matrix_that_rounding_has_made_indefinite_is_inverted_all_the_same() -> None:
    S = np.diag([1.0, 2.0, -1e-18])
    np.testing.assert_allclose(inverse_spd(S), np.diag([1.0, 0.5, -1e18]))


def test_three_by_three_by_cofactors_and_by_cholesky() -> None:
    S, v = _covariance(3), _RNG.normal(size=3)
    np.testing.assert_allclose(inverse_3(S), np.linalg.inv(S), rtol=1e-10)
    np.testing.assert_allclose(whitened_3(S, v), np.linalg.solve(np.linalg.cholesky(S), v), rtol=1e-10)
