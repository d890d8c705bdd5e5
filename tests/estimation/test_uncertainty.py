"""First-order covariance: Jacobians against finite differences, the result against Monte Carlo."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ghest_rt.estimation.angles import euler_yxz, rotation_from_euler_yxz
from ghest_rt.estimation.arm import eq8_e_from_gh, eq9_e_from_elw, eq10_m0_from_arm, gh_from_arm_rotation, step3_4_5_e_from_arm
from ghest_rt.estimation.factory import make_estimator
from ghest_rt.estimation.uncertainty import covariance_in_e, euler_sigma_rad, rotation_jacobians
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3, log_so3
from ghest_rt.messages.results import Reason, Status

T = 1_000_000_000


def perturbed(pose: np.ndarray, error: np.ndarray) -> np.ndarray:
    return transform(exp_so3(error[:3]) @ pose[:3, :3], pose[:3, 3] + error[3:])


def gh_from_arm(clinic: Any, e_from_m0: np.ndarray, e_from_m1: np.ndarray) -> np.ndarray:
    e_from_arm = step3_4_5_e_from_arm(
        eq8_e_from_gh(e_from_m0, clinic.m0_from_gh), eq9_e_from_elw(e_from_m1, clinic.m1_from_elw)
    )
    assert e_from_arm is not None
    return gh_from_arm_rotation(clinic.m0_from_gh, eq10_m0_from_arm(e_from_m0, e_from_arm))


def imperfect_posture(clinic: Any, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return markers whose elbow frame is not quite square to the arm, as with a marker that has slipped."""
    truth = clinic.random_posture(rng)
    return truth.e_from_m0, perturbed(truth.e_from_m1, 0.2 * rng.normal(size=6) * [1, 1, 1, 0.1, 0.1, 0.1])


def test_jacobians_agree_with_finite_differences(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(3)
    rng = np.random.default_rng(31)
    step = 1e-6
    for _ in range(20):
        m0, m1 = imperfect_posture(clinic, rng)
        e_from_gh, e_from_elw = eq8_e_from_gh(m0, clinic.m0_from_gh), eq9_e_from_elw(m1, clinic.m1_from_elw)
        e_from_arm = step3_4_5_e_from_arm(e_from_gh, e_from_elw)
        assert e_from_arm is not None
        J_0, J_1 = rotation_jacobians(m0, m1, e_from_gh, e_from_elw, e_from_arm)
        for k in range(6):
            error = step * np.eye(6)[k]
            for J, plus, minus in (
                (J_0, gh_from_arm(clinic, perturbed(m0, error), m1), gh_from_arm(clinic, perturbed(m0, -error), m1)),
                (J_1, gh_from_arm(clinic, m0, perturbed(m1, error)), gh_from_arm(clinic, m0, perturbed(m1, -error))),
            ):
                np.testing.assert_allclose(J[:, k], log_so3(plus @ minus.T) / (2 * step), atol=1e-6)


def test_the_published_covariance_is_that_of_the_scatter(make_clinic: Callable[..., Any]) -> None:
    """Camera poses, lever arms and frames all take part: noise is put on what the cameras see."""
    clinic = make_clinic(4)
    rng = np.random.default_rng(41)
    truth = clinic.random_posture(rng)
    factors = {camera: rng.normal(size=(6, 6)) * 1e-3 * np.array([[1, 1, 1, 0.2, 0.2, 0.2]]).T for camera in ("r0", "r1")}
    covariances = {camera: factor @ factor.T for camera, factor in factors.items()}

    def estimate(noisy: bool) -> Any:
        estimator = make_estimator(clinic.config, clinic.urdf, "u", ("yaw", "reach"), method="refined")
        estimator.add_encoder(clinic.encoder(truth, T))
        for camera in ("r0", "r1"):
            seen = clinic.observation(camera, truth, T).camera_from_marker
            if noisy:
                seen = perturbed(seen, factors[camera] @ rng.normal(size=6))
            estimator.add_marker(clinic.observation(camera, truth, T, camera_from_marker=seen, covariance=covariances[camera]))
        return estimator.estimate(T)

    stated = estimate(noisy=False).covariance
    found = [estimate(noisy=True) for _ in range(3000)]
    errors = np.array([log_so3(truth.gh_from_arm @ each.gh_from_arm.T) for each in found])
    scatter = errors.T @ errors / len(errors)
    np.testing.assert_allclose(scatter, stated, atol=0.1 * np.abs(stated).max())

    sigma = euler_sigma_rad(truth.gh_from_arm, stated)
    true = euler_yxz(truth.gh_from_arm)
    angles = np.array([[e.a_rad, e.b_rad, e.g_rad] for e in (euler_yxz(each.gh_from_arm) for each in found)])
    spread = np.sqrt(np.mean(np.square(angles - [true.a_rad, true.b_rad, true.g_rad]), axis=0))
    np.testing.assert_allclose(sigma, spread, rtol=0.06)


def test_a_covariance_turns_with_the_camera() -> None:
    rng = np.random.default_rng(6)
    e_from_camera = transform(exp_so3(rng.normal(size=3)), rng.normal(size=3))
    factor = rng.normal(size=(6, 6))
    turn = np.kron(np.eye(2), e_from_camera[:3, :3])
    np.testing.assert_allclose(covariance_in_e(factor @ factor.T, e_from_camera), turn @ factor @ factor.T @ turn.T, atol=1e-12)


@pytest.mark.parametrize("off_rad", [1e-1, 1e-3, 1e-8, 1e-300, 0.0])
def test_near_the_singularity_sigma_grows_but_stays_a_number(off_rad: float) -> None:
    R = rotation_from_euler_yxz(0.3, math.pi / 2 - off_rad, 0.0)
    a, b, g = euler_sigma_rad(R, 1e-6 * np.eye(3))
    assert b == pytest.approx(1e-3)
    expected = min(1e-3 / max(off_rad, 1e-12), math.pi / math.sqrt(3))
    assert g == pytest.approx(expected, rel=0.02)
    assert a == pytest.approx(expected, rel=0.02)


def test_an_uncertain_angle_is_degraded_and_still_told(make_clinic: Callable[..., Any]) -> None:
    for limit_deg, status, reason in ((5.0, Status.VALID, Reason.NONE), (0.5, Status.DEGRADED, Reason.UNCERTAIN)):
        clinic = make_clinic(4, sigma_limit_deg=limit_deg)
        truth = clinic.posture(np.eye(3), np.eye(4), np.zeros(2))
        estimator = make_estimator(clinic.config, clinic.urdf, "u", ("yaw", "reach"), method="refined")
        for t_ns in range(T - 45_000_000, T + 1, 15_000_000):
            estimator.add_encoder(clinic.encoder(truth, t_ns))
            for camera in ("r0", "r1"):
                estimator.add_marker(clinic.observation(camera, truth, t_ns, covariance=np.diag([8e-4] * 3 + [1e-8] * 3)))
        found = estimator.estimate(T)
        assert (found.status, found.reason) == (status, reason)
        assert found.gh_from_arm is not None
