"""Rotations and rigid transforms: axioms, bijections and finite differences, near the identity and near pi too."""

import numpy as np
import pytest

from ghest_rt.geometry.se3 import interpolate, inverse, rigidity_problem, transform
from ghest_rt.geometry.so3 import (
    angle_between_rad,
    exp_so3,
    log_so3,
    matrix_from_quat_wxyz,
    nearest_rotation,
    quat_wxyz_from_matrix,
    rot_x,
    rot_y,
    rot_z,
    slerp,
)

SCIPY = pytest.importorskip("scipy.spatial.transform", reason="the second opinion needs the extra [sim]")


def rotation_vectors() -> list[np.ndarray]:
    rng = np.random.default_rng(7)
    directions = rng.normal(size=(40, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    angles = [0.0, 1e-12, 1e-8, 1e-4, 0.3, 1.0, 2.0, 3.0, np.pi - 1e-6]
    return [angle * direction for angle in angles for direction in directions]


@pytest.mark.parametrize("chunk", range(4))
def test_exp_agrees_with_scipy_and_log_inverts_it(chunk: int) -> None:
    for v in rotation_vectors()[chunk::4]:
        R = exp_so3(v)
        np.testing.assert_allclose(R, SCIPY.Rotation.from_rotvec(v).as_matrix(), atol=1e-14)
        np.testing.assert_allclose(log_so3(R), v, atol=1e-9)


def test_quaternions_round_trip_with_positive_scalar_part() -> None:
    for v in rotation_vectors():
        q = quat_wxyz_from_matrix(exp_so3(v))
        assert q[0] >= 0.0
        np.testing.assert_allclose(matrix_from_quat_wxyz(q), exp_so3(v), atol=1e-14)


def test_elementary_rotations_are_those_of_the_exponential() -> None:
    for function, axis in ((rot_x, 0), (rot_y, 1), (rot_z, 2)):
        np.testing.assert_allclose(function(0.7), exp_so3(0.7 * np.eye(3)[axis]), atol=1e-15)


def test_slerp_moves_at_constant_rate() -> None:
    R_0, R_1 = exp_so3(np.array([0.1, 0.2, -0.3])), exp_so3(np.array([1.0, -0.4, 0.2]))
    whole = angle_between_rad(R_0, R_1)
    assert angle_between_rad(R_0, slerp(R_0, R_1, 0.25)) == pytest.approx(0.25 * whole)
    np.testing.assert_allclose(slerp(R_0, R_1, 1.0), R_1, atol=1e-14)


def test_nearest_rotation_repairs_a_noisy_matrix_and_never_mirrors() -> None:
    rng = np.random.default_rng(3)
    for v in rotation_vectors()[::17]:
        R = nearest_rotation(exp_so3(v) + rng.normal(scale=1e-3, size=(3, 3)))
        assert np.linalg.det(R) == pytest.approx(1.0)
        assert angle_between_rad(R, exp_so3(v)) < 5e-3


def test_inverse_and_interpolation_of_transforms() -> None:
    T_0 = transform(exp_so3(np.array([0.3, 0.1, 0.0])), [1.0, 2.0, 3.0])
    T_1 = transform(exp_so3(np.array([0.0, 0.9, 0.2])), [0.0, -1.0, 0.5])
    np.testing.assert_allclose(T_0 @ inverse(T_0), np.eye(4), atol=1e-15)
    np.testing.assert_allclose(interpolate(T_0, T_1, 0.0), T_0, atol=1e-14)
    np.testing.assert_allclose(interpolate(T_0, T_1, 1.0), T_1, atol=1e-14)


@pytest.mark.parametrize(
    ("matrix", "word"),
    [
        (np.diag([1.0, 1.0, 1.01, 1.0]), "orthonormal"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "mirror"),
        (np.full((4, 4), np.nan), "finite"),
        (np.eye(3), "shape"),
        (np.vstack([np.eye(4)[:3], [0.0, 0.0, 0.0, 2.0]]), "last row"),
    ],
)
def test_what_is_not_rigid_is_named(matrix: np.ndarray, word: str) -> None:
    assert word in (rigidity_problem(matrix) or "")
    assert rigidity_problem(np.eye(4)) is None
