"""The elbow's angles from the forearm's direction, either arm; their standard deviations against sampling."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ghest_rt.config.station import Elbow, StationConfig
from ghest_rt.estimation.arm_chain import ArmChain
from ghest_rt.estimation.elbow import ElbowGeometry
from ghest_rt.estimation.factory import make_estimator
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3
from ghest_rt.kinematics.forward import ForwardKinematics
from ghest_rt.messages.results import ElbowAngles

MS = 1_000_000
T = 1_000 * MS
AXIS = np.array([0.6, 0.8, 0.0])


def geometry(clinic: Any, arm: str, sigma_deg: float = 3.0) -> ElbowGeometry:
    fk = ForwardKinematics(clinic.urdf, "u", base_link="l0", links=("l8",), settings_m={}, measured_joints=("yaw", "reach"))
    elbow = Elbow(link="l8", axis=(0.6, 0.8, 0.0), axis_sigma_deg=sigma_deg, pronation_joint="reach")
    return ElbowGeometry(elbow, "right" if arm == "right" else "left", fk, ("yaw", "reach"))


def arm_that_sees(e_direction: np.ndarray, arm_direction: np.ndarray) -> np.ndarray:
    """Return a rotation that takes `arm_direction` to `e_direction`."""
    axis = np.cross(arm_direction, e_direction)
    angle = np.arctan2(np.linalg.norm(axis), arm_direction @ e_direction)
    return exp_so3(axis / np.linalg.norm(axis) * angle)


@pytest.mark.parametrize("arm", ["right", "left"])
@pytest.mark.parametrize(("flexion_deg", "carrying_deg"), [(0.0, 0.0), (90.0, 0.0), (35.0, 12.0), (130.0, -20.0)])
def test_angles_are_read_off_as_defined(
    make_clinic: Callable[..., Any], arm: str, flexion_deg: float, carrying_deg: float
) -> None:
    clinic = make_clinic(3)
    joints = np.array([0.4, -0.9])
    l8 = clinic.e_from_camera("r1", joints) @ np.linalg.inv(clinic.link_from_camera["r1"])
    flexion, carrying = np.radians((flexion_deg, carrying_deg))
    side = 1.0 if arm == "right" else -1.0
    f = np.array([np.sin(carrying), side * np.cos(carrying) * np.sin(flexion), -np.cos(carrying) * np.cos(flexion)])
    R = arm_that_sees(l8[:3, :3] @ AXIS, f)
    found = geometry(clinic, arm).angles(transform(R, [0.1, 0.2, 0.3]), joints, None)
    assert found is not None
    assert np.degrees((found.flexion_rad, found.carrying_rad)) == pytest.approx((flexion_deg, carrying_deg), abs=1e-9)
    assert found.pronation_rad == -0.9
    assert found.sigma_rad is None


@pytest.mark.parametrize("arm", ["right", "left"])
def test_standard_deviations_are_those_of_samples(make_clinic: Callable[..., Any], arm: str) -> None:
    clinic = make_clinic(4)
    rng = np.random.default_rng(1)
    L = rng.normal(size=(3, 3)) * 0.01
    joints, e_from_arm = np.array([0.3, 0.8]), transform(exp_so3(rng.normal(size=3)), [0.0, 0.0, 0.0])
    eyes = geometry(clinic, arm, sigma_deg=1e-6)
    found = eyes.angles(e_from_arm, joints, L @ L.T)
    assert found is not None and found.sigma_rad is not None
    samples = []
    for _ in range(1500):
        off = eyes.angles(transform(exp_so3(L @ rng.normal(size=3)) @ e_from_arm[:3, :3], [0, 0, 0]), joints, None)
        assert off is not None
        samples.append((off.flexion_rad, off.carrying_rad))
    assert np.std(samples, axis=0) == pytest.approx(found.sigma_rad, rel=0.08)


def test_the_strap_is_in_the_standard_deviation(make_clinic: Callable[..., Any]) -> None:
    found = geometry(make_clinic(4), "right", sigma_deg=3.0).angles(np.eye(4), np.array([0.3, 0.8]), np.zeros((3, 3)))
    assert found is not None and found.sigma_rad is not None
    assert np.degrees(found.sigma_rad[1]) == pytest.approx(3.0)
    assert np.degrees(found.sigma_rad[0]) >= 3.0


def test_no_flexion_where_the_forearm_lies_along_its_axis(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(3)
    joints = np.zeros(2)
    l8 = clinic.e_from_camera("r1", joints) @ np.linalg.inv(clinic.link_from_camera["r1"])
    R = arm_that_sees(l8[:3, :3] @ AXIS, np.array([1.0, 0.0, 0.0]))
    assert geometry(clinic, "right").angles(transform(R, [0, 0, 0]), joints, None) is None


def estimate_elbow(clinic: Any, method: str, elbow: Elbow | None) -> ElbowAngles | None:
    config: StationConfig = clinic.config.model_copy(update={"elbow": elbow})
    estimator = make_estimator(config, clinic.urdf, "u", ("yaw", "reach"), method=method)
    for k in range(-4, 30):
        t_ns = T + 15 * k * MS
        posture = clinic.moving(t_ns)
        estimator.add_encoder(clinic.encoder(posture, t_ns, k + 4))
        for camera in ("r0", "r1"):
            estimator.add_marker(clinic.observation(camera, posture, t_ns))
    return estimator.estimate(T + 15 * 28 * MS).elbow


@pytest.mark.parametrize("method", ["paper", "refined"])
def test_every_method_gives_the_elbow_where_the_station_says_how(make_clinic: Callable[..., Any], method: str) -> None:
    """`fused` draws conclusions from where a forearm can be, which this made-up link is not: see tests/limbs."""
    clinic = make_clinic(2)
    elbow = Elbow(link="l8", axis=(0.6, 0.8, 0.0))
    found = estimate_elbow(clinic, method, elbow)
    assert found is not None and found.sigma_rad is not None
    truth = clinic.moving(T + 15 * 28 * MS)
    chain = ArmChain(clinic.config.model_copy(update={"elbow": elbow}), clinic.urdf, "u", ("yaw", "reach"))
    meant = chain.elbow_angles(truth.e_from_arm, truth.joints_rad, None)
    assert meant is not None
    assert found.flexion_rad == pytest.approx(meant.flexion_rad, abs=5e-3)
    assert found.carrying_rad == pytest.approx(meant.carrying_rad, abs=5e-3)
    assert found.pronation_rad is None
    assert estimate_elbow(clinic, method, None) is None
