"""The paper's chain recovers a known posture, and the angles built step by step as the paper says are those of the frame."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ghest_rt.estimation.arm import eq8_e_from_gh, eq9_e_from_elw, eq10_m0_from_arm, gh_from_arm_rotation, step3_4_5_e_from_arm
from ghest_rt.estimation.factory import EstimatorMethod, make_estimator
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import exp_so3, rot_x, rot_y, rot_z
from ghest_rt.messages.results import Status

T = 1_000_000_000


@pytest.mark.parametrize("method", ["paper", "refined"])
def test_random_postures_are_recovered_exactly(make_clinic: Callable[..., Any], method: EstimatorMethod) -> None:
    for seed in range(5):
        clinic = make_clinic(seed)
        rng = np.random.default_rng(100 + seed)
        for _ in range(40):
            truth = clinic.random_posture(rng)
            estimator = make_estimator(clinic.config, clinic.urdf, "two_joints.urdf", ("yaw", "reach"), method=method)
            estimator.add_encoder(clinic.encoder(truth, T))
            estimator.add_marker(clinic.observation("r0", truth, T))
            estimator.add_marker(clinic.observation("r1", truth, T))
            found = estimator.estimate(T)
            assert found.status is Status.VALID, found.reason
            np.testing.assert_allclose(found.gh_from_arm, truth.gh_from_arm, atol=1e-9)
            np.testing.assert_allclose(found.m0_from_arm, inverse(truth.e_from_m0) @ truth.e_from_arm, atol=1e-9)
            np.testing.assert_allclose(found.e_from_m0, truth.e_from_m0, atol=1e-9)
            np.testing.assert_allclose(found.e_from_m1, truth.e_from_m1, atol=1e-9)


def test_the_frame_is_that_of_the_papers_three_angles() -> None:
    """Steps (3) and (4), angle by angle, against the frame built without them."""
    rng = np.random.default_rng(5)
    for _ in range(200):
        e_from_gh = transform(np.eye(3), rng.normal(size=3))
        e_from_elw = transform(exp_so3(rng.normal(size=3)), rng.normal(size=3))
        V = e_from_gh[:3, 3] - e_from_elw[:3, 3]
        V /= np.linalg.norm(V)
        a = math.atan2(V[0], V[2])
        b = -math.asin(V[1])
        moved = rot_y(a) @ rot_x(b)
        u = e_from_elw[:3, 0]
        across = u - (u @ V) * V
        g = math.atan2(across @ moved[:, 1], across @ moved[:, 0])
        arm = step3_4_5_e_from_arm(e_from_gh, e_from_elw)
        assert arm is not None
        np.testing.assert_allclose(arm[:3, :3], moved @ rot_z(g), atol=1e-9)
        np.testing.assert_allclose(arm[:3, 3], 0.5 * (e_from_gh[:3, 3] + e_from_elw[:3, 3]), atol=1e-12)


def test_equations_8_9_10_by_a_point_followed_through_the_frames() -> None:
    rng = np.random.default_rng(6)
    e_from_m0, m0_from_gh = (transform(exp_so3(rng.normal(size=3)), rng.normal(size=3)) for _ in range(2))
    point_in_gh = np.array([0.1, 0.2, 0.3, 1.0])
    np.testing.assert_allclose(eq8_e_from_gh(e_from_m0, m0_from_gh) @ point_in_gh, e_from_m0 @ (m0_from_gh @ point_in_gh))
    np.testing.assert_allclose(eq9_e_from_elw(e_from_m0, m0_from_gh) @ point_in_gh, e_from_m0 @ (m0_from_gh @ point_in_gh))
    e_from_arm = transform(exp_so3(rng.normal(size=3)), rng.normal(size=3))
    m0_from_arm = eq10_m0_from_arm(e_from_m0, e_from_arm)
    np.testing.assert_allclose(e_from_m0 @ (m0_from_arm @ point_in_gh), e_from_arm @ point_in_gh, atol=1e-12)
    axis_in_m0 = m0_from_gh[:3, :3] @ (gh_from_arm_rotation(m0_from_gh, m0_from_arm) @ [0.0, 0.0, 1.0])
    np.testing.assert_allclose(axis_in_m0, m0_from_arm[:3, 2], atol=1e-12)


def test_the_neutral_posture_is_the_identity() -> None:
    """Arm forward and level: elbow 0.3 m in front (z backwards) of the shoulder, marker x up."""
    elw = np.column_stack([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    arm = step3_4_5_e_from_arm(transform(np.eye(3), [0.4, 0.2, 0.1]), transform(elw, [0.4, 0.2, -0.2]))
    np.testing.assert_allclose(arm, transform(np.eye(3), [0.4, 0.2, -0.05]), atol=1e-15)


def test_there_is_no_frame_without_a_direction() -> None:
    here = transform(np.eye(3), [0.1, 0.2, 0.3])
    assert step3_4_5_e_from_arm(here, here) is None
    x_along_arm = transform(np.eye(3), [0.4, 0.2, 0.3])
    assert step3_4_5_e_from_arm(here, x_along_arm) is None
    assert step3_4_5_e_from_arm(here, transform(np.eye(3), [math.nan, 0.0, 0.0])) is None
