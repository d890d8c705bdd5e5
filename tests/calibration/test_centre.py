"""The point that two bodies share: found among noise and outliers, with a covariance that holds, or said to be unknowable."""

import numpy as np
import pytest

from ghest_rt.calibration.centre import SharedCentre, UnknowableCentreError, find_centre
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, exp_so3, rot_z

FIRST_M = np.array([-0.055, -0.010, -0.085])
SECOND_M = np.array([0.002, 0.265, -0.055])


def poses(rotvecs: Array, *, noise_m: float = 0.001, seed: int = 1) -> tuple[Array, Array]:
    """Two bodies that share a point, the second turned against the first by (n, 3) rotation vectors, rad."""
    rng = np.random.default_rng(seed)
    first, second = [], []
    for rotvec in rotvecs:
        R, S = exp_so3(0.1 * rotvec + 0.3), exp_so3(0.1 * rotvec + 0.3) @ exp_so3(rotvec)
        centre = 0.02 * rotvec
        first.append(transform(R, centre - R @ FIRST_M + noise_m * rng.standard_normal(3)))
        second.append(transform(S, centre - S @ SECOND_M + noise_m * rng.standard_normal(3)))
    return np.array(first), np.array(second)


def turning(count: int = 600, spread_rad: float = 0.25) -> Array:
    t = np.linspace(0.0, 20.0, count)
    return spread_rad * np.column_stack((np.sin(1.1 * t), np.sin(1.7 * t + 1.0), np.sin(0.7 * t + 2.0)))


def found(first: Array, second: Array) -> SharedCentre:
    return find_centre(first, second, np.arange(len(first)) // 30)


def test_both_centres_are_found_to_a_fraction_of_the_noise() -> None:
    centre = found(*poses(turning()))
    assert np.linalg.norm(centre.first_m - FIRST_M) < 0.0007
    assert np.linalg.norm(centre.second_m - SECOND_M) < 0.0007
    assert centre.residual_rms_m == pytest.approx(0.001 * np.sqrt(6.0), rel=0.1)


def test_outliers_do_not_count() -> None:
    first, second = poses(turning())
    second[::10, :3, 3] += (0.05, -0.03, 0.04)
    centre = found(first, second)
    assert np.linalg.norm(centre.first_m - FIRST_M) < 0.001
    assert np.linalg.norm(centre.second_m - SECOND_M) < 0.001
    assert not centre.used[::10].any()
    assert centre.used.mean() == pytest.approx(0.9, abs=0.02)


def test_the_covariance_is_that_of_the_errors() -> None:
    squares = []
    for seed in range(60):
        centre = found(*poses(turning(), seed=seed))
        error = np.concatenate((centre.first_m - FIRST_M, centre.second_m - SECOND_M))
        squares.append(error @ np.linalg.solve(centre.covariance, error))
    # 6 if the covariance is right; twenty blocks estimate it from few, hence somewhat more.
    assert 5.0 < np.mean(squares) < 12.0


def test_residuals_alike_within_a_second_widen_the_covariance() -> None:
    first, second = poses(turning(), noise_m=0.0)
    rng = np.random.default_rng(5)
    white, alike = first.copy(), first.copy()
    white[:, :3, 3] += 0.002 * rng.standard_normal((600, 3))
    alike[:, :3, 3] += 0.002 * np.repeat(rng.standard_normal((20, 3)), 30, axis=0)
    assert found(alike, second).first_sigma_m > 3.0 * found(white, second).first_sigma_m


def test_turning_about_one_axis_leaves_the_centre_unknown() -> None:
    hinge = np.column_stack((np.zeros(300), np.zeros(300), np.linspace(-0.6, 0.6, 300)))
    first, second = poses(hinge, noise_m=0.0)
    with pytest.raises(UnknowableCentreError, match="one axis"):
        found(first, second)


def test_a_little_turning_gives_a_large_sigma_and_the_spread_that_there_was() -> None:
    little, enough = found(*poses(turning(spread_rad=0.02))), found(*poses(turning()))
    assert little.second_sigma_m > 8.0 * enough.second_sigma_m
    assert np.degrees(enough.spread_rad) == pytest.approx(np.full(3, np.degrees(0.25 / np.sqrt(2.0))), abs=2.0)


def test_bodies_hardly_seen_together_are_refused() -> None:
    first, second = poses(turning(9))
    with pytest.raises(UnknowableCentreError, match="9 instants"):
        found(first, second)


def test_the_frame_of_the_poses_does_not_matter() -> None:
    first, second = poses(turning())
    elsewhere = transform(rot_z(1.0), (0.5, -2.0, 1.0))
    here, there = found(first, second), found(elsewhere @ first, elsewhere @ second)
    assert there.first_m == pytest.approx(here.first_m, abs=1e-9)
    assert there.covariance == pytest.approx(here.covariance, rel=1e-5, abs=1e-15)
