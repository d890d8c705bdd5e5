"""Every set of angles: known postures, round trips, mirrored arms, and the neighbourhood of its singularity."""

import math
from dataclasses import astuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ghest_rt.estimation.angles import (
    Arm,
    clinical,
    euler_yxz,
    rotation_from_clinical,
    rotation_from_euler_yxz,
)
from ghest_rt.estimation.isb import isb_yxy, rotation_from_isb_yxy
from ghest_rt.estimation.swing_twist import rotation_from_swing_twist, rotation_from_tilt_torsion, swing_twist
from ghest_rt.geometry.so3 import angle_between_rad, exp_so3

PI = math.pi
ARMS: tuple[Arm, ...] = ("right", "left")
MIRROR = np.diag([1.0, -1.0, 1.0])
rotation_vectors = st.tuples(*[st.floats(-3.1, 3.1)] * 3).map(np.array)
arms = st.sampled_from(ARMS)


def rotations() -> list[np.ndarray]:
    """Uniform, near the identity, and in and around every singularity."""
    rng = np.random.default_rng(1)
    found = [Rotation.from_quat(rng.normal(size=4)).as_matrix() for _ in range(200)]
    found += [exp_so3(10.0**-k * rng.normal(size=3)) for k in range(0, 17, 2)]
    for k in [*range(0, 17, 2), 400]:
        for sign in (-1.0, 1.0):
            off = 10.0**-k
            found.append(rotation_from_euler_yxz(0.4, sign * (PI / 2 - off), -0.8))
            found.append(rotation_from_isb_yxy(0.4, off if sign > 0 else PI - off, -0.8, "right"))
            found.append(rotation_from_swing_twist(sign * 0.6 * (PI - off), 0.8 * (PI - off), -0.8, "right"))
            found.append(rotation_from_tilt_torsion(0.4, off if sign > 0 else PI - off, -0.8, "right"))
    return found


@pytest.mark.parametrize("arm", ARMS)
def test_every_set_gives_the_rotation_back_even_at_its_singularity(arm: Arm) -> None:
    for R in rotations():
        euler = euler_yxz(R)
        named = clinical(euler, arm)
        isb = isb_yxy(R, arm)
        swing = swing_twist(R, arm)
        backs = [
            rotation_from_euler_yxz(euler.a_rad, euler.b_rad, euler.g_rad),
            rotation_from_clinical(named.flexion_rad, named.abduction_rad, named.rotation_rad, arm),
            rotation_from_isb_yxy(isb.plane_of_elevation_rad, isb.elevation_rad, isb.axial_rotation_rad, arm),
            rotation_from_swing_twist(swing.swing_flexion_rad, swing.swing_abduction_rad, swing.twist_rad, arm),
            rotation_from_tilt_torsion(swing.azimuth_rad, swing.tilt_rad, swing.twist_rad, arm),
        ]
        for values in (euler, named, isb, swing):
            assert np.isfinite(astuple(values)).all()
        for back in backs:
            assert angle_between_rad(back, R) < 1e-7


@given(rotation_vectors)
@settings(deadline=None, derandomize=True)
def test_a_mirrored_movement_of_the_left_arm_has_the_same_clinical_angles(v: np.ndarray) -> None:
    R = exp_so3(v)
    mirrored = MIRROR @ R @ MIRROR
    assert clinical(euler_yxz(mirrored), "left") == clinical(euler_yxz(R), "right")
    assert isb_yxy(mirrored, "left") == isb_yxy(R, "right")
    assert swing_twist(mirrored, "left") == swing_twist(R, "right")


@given(rotation_vectors, arms)
@settings(deadline=None, derandomize=True)
def test_ranges_are_those_stated(v: np.ndarray, arm: Arm) -> None:
    R = exp_so3(v)
    euler, isb, swing = euler_yxz(R), isb_yxy(R, arm), swing_twist(R, arm)
    assert abs(euler.b_rad) <= PI / 2
    assert max(abs(euler.a_rad), abs(euler.g_rad)) <= PI
    assert 0.0 <= isb.elevation_rad <= PI
    assert max(abs(isb.plane_of_elevation_rad), abs(isb.axial_rotation_rad)) <= PI
    assert 0.0 <= swing.tilt_rad <= PI
    assert math.hypot(swing.swing_flexion_rad, swing.swing_abduction_rad) == pytest.approx(swing.tilt_rad)


def test_the_sequences_agree_with_scipy() -> None:
    R = np.array([Rotation.from_rotvec(v).as_matrix() for v in np.random.default_rng(2).normal(size=(100, 3))])
    theirs = Rotation.from_matrix(R).as_euler("YXZ")
    ours = [astuple(euler_yxz(each))[:3] for each in R]
    np.testing.assert_allclose(ours, theirs, atol=1e-9)
    isb_from_gh = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    arm_from_humerus = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    for each in R:
        isb = isb_yxy(each, "right")
        again = Rotation.from_euler("YXY", [isb.plane_of_elevation_rad, -isb.elevation_rad, isb.axial_rotation_rad]).as_matrix()
        np.testing.assert_allclose(again, isb_from_gh @ each @ arm_from_humerus, atol=1e-9)


UP, LEFT, BACK = np.eye(3)


def frame(elbow_points: np.ndarray, forearm_points: np.ndarray, arm: Arm) -> np.ndarray:
    """Return gh_from_arm of a person whose upper arm and (flexed by 90 deg) forearm point somewhere.

    In the zero posture the arm points forwards and the forearm towards the midline.
    """
    z = -elbow_points
    y = forearm_points if arm == "right" else -forearm_points
    return np.column_stack([np.cross(y, z), y, z])


def medial(arm: Arm) -> np.ndarray:
    return LEFT if arm == "right" else -LEFT


@pytest.mark.parametrize("arm", ARMS)
def test_known_postures_have_the_angles_a_clinician_expects(arm: Arm) -> None:
    deg = math.degrees
    forward, hanging = -BACK, -UP
    sixty = math.radians(60.0)

    zero = frame(forward, medial(arm), arm)
    np.testing.assert_allclose(zero, np.eye(3), atol=1e-15)

    raised = frame(math.cos(sixty) * forward + math.sin(sixty) * UP, medial(arm), arm)
    assert deg(clinical(euler_yxz(raised), arm).flexion_rad) == pytest.approx(60.0)
    assert deg(swing_twist(raised, arm).swing_flexion_rad) == pytest.approx(60.0)
    isb = isb_yxy(raised, arm)
    assert [deg(v) for v in astuple(isb)[:3]] == pytest.approx([90.0, 150.0, 0.0])

    aside = math.cos(sixty) * forward - math.sin(sixty) * medial(arm)
    abducted = frame(aside, math.cos(sixty) * medial(arm) + math.sin(sixty) * forward, arm)
    assert [deg(v) for v in astuple(clinical(euler_yxz(abducted), arm))[:3]] == pytest.approx([0.0, 60.0, 0.0])
    assert deg(swing_twist(abducted, arm).swing_abduction_rad) == pytest.approx(60.0)
    assert [deg(v) for v in astuple(isb_yxy(abducted, arm))[:3]] == pytest.approx([30.0, 90.0, 0.0])

    inward = frame(forward, math.cos(sixty) * medial(arm) + math.sin(sixty) * hanging, arm)
    assert [deg(v) for v in astuple(clinical(euler_yxz(inward), arm))[:3]] == pytest.approx([0.0, 0.0, 60.0])
    assert deg(swing_twist(inward, arm).twist_rad) == pytest.approx(60.0)
    assert [deg(v) for v in astuple(isb_yxy(inward, arm))[:3]] == pytest.approx([90.0, 90.0, 60.0])

    at_side = frame(0.99 * hanging + math.sqrt(1 - 0.99**2) * forward, forward * 0.99 + math.sqrt(1 - 0.99**2) * UP, arm)
    assert isb_yxy(at_side, arm).near_singularity
    assert deg(isb_yxy(at_side, arm).elevation_rad) == pytest.approx(deg(math.acos(0.99)))


@pytest.mark.parametrize(("off_deg", "near"), [(9.9, True), (10.1, False)])
def test_flags_go_up_within_ten_degrees_of_a_singularity(off_deg: float, near: bool) -> None:
    off = math.radians(off_deg)
    for sign in (-1.0, 1.0):
        assert euler_yxz(rotation_from_euler_yxz(1.0, sign * (PI / 2 - off), 2.0)).near_singularity is near
    for elevation in (off, PI - off):
        assert isb_yxy(rotation_from_isb_yxy(1.0, elevation, 2.0, "left"), "left").near_singularity is near
        tilted = swing_twist(rotation_from_tilt_torsion(1.0, elevation, 2.0, "left"), "left")
        assert tilted.azimuth_near_singularity is near
        assert tilted.near_singularity is (near and elevation > 1.0)
