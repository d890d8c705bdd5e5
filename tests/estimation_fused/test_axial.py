"""m1 that slips about the arm, judged by the forearm."""

import math

import numpy as np
import pytest

from ghest_rt.estimation.fused.axial import AxialJudge, Slip, twist_rad
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.so3 import exp_so3, rot_y, rot_z
from tests.estimation_fused.stand import MS, START


def shown(slip_rad: float, elbow_rad: float) -> np.ndarray:
    """The forearm in the elbow frame as m1 shows it, when the humerus has turned by `slip_rad` more than m1 about the arm."""
    forearm = np.array([0.02, -math.cos(elbow_rad), -math.sin(elbow_rad)])
    return rot_y(slip_rad) @ (forearm / np.linalg.norm(forearm))


def session(lag: float, shift_rad: float, seconds: float = 8.0, elbow_deg: float = 80.0) -> Slip:
    """Slip found after a session of axial rotation by 20 deg to and fro, with the shift coming at 4 s."""
    judge = AxialJudge(Tuning())
    rng = np.random.default_rng(3)
    for k in range(round(seconds * 25)):
        t = k / 25.0
        true = math.radians(20.0) * math.sin(2.0 * math.pi * 0.25 * t)
        at_skin = (1.0 - lag) * true - (shift_rad if t > 4.0 else 0.0)
        wander = math.radians(0.3) * rng.standard_normal()
        judge.add(START + k * 40 * MS, shown(true - at_skin + wander, math.radians(elbow_deg)), at_skin)
    return judge.slip


def test_skin_that_follows_seven_tenths_of_the_rotation_is_made_up_for() -> None:
    slip = session(0.3, 0.0)
    at_skin = 0.7 * math.radians(20.0)
    found, variance = slip.at(at_skin)
    assert abs(math.degrees(found) - 6.0) < 0.5
    assert abs(math.degrees(found) - 6.0) < 2.0 * math.degrees(math.sqrt(variance))
    assert slip.shifted < 0.1


def test_a_cuff_that_turns_during_the_session_is_found() -> None:
    slip = session(0.0, math.radians(5.0))
    assert slip.shifted > 0.9
    assert abs(math.degrees(slip.shift_rad) - 5.0) < 0.7
    assert slip.lag == 0.0


def test_a_cuff_that_has_just_turned_is_in_the_variance_before_the_means_tell() -> None:
    slip = session(0.0, math.radians(5.0), seconds=4.2)
    found, variance = slip.at(0.0)
    assert abs(math.degrees(found)) < 2.0
    assert abs(math.degrees(found) - 5.0) < 2.0 * math.degrees(math.sqrt(variance))
    before = session(0.0, math.radians(5.0), seconds=3.9)
    assert before.at(0.0) == (0.0, 0.0)


def test_a_forearm_that_is_not_centred_makes_no_slip() -> None:
    assert session(0.0, 0.0) == Slip()


@pytest.mark.parametrize("hold_s", [0.0, 4.0])
def test_a_carrying_angle_makes_no_slip_when_the_elbow_stretches(hold_s: float) -> None:
    judge = AxialJudge(Tuning())
    for k in range(round((8.0 + hold_s) * 25)):
        t = k / 25.0
        elbow_rad = math.radians(90.0 - 65.0 * min(max((t - 3.0) / 4.0, 0.0), 1.0))
        at_skin = math.radians(20.0) * math.sin(2.0 * math.pi * 0.25 * t)
        forearm = np.array([math.sin(math.radians(4.0)), -math.cos(elbow_rad), -math.sin(elbow_rad)])
        judge.add(START + k * 40 * MS, forearm / np.linalg.norm(forearm), at_skin)
    slip_rad, variance = judge.slip.at(0.0)
    assert judge.slip.shifted < 0.5
    assert abs(math.degrees(slip_rad)) < 1.5
    assert math.degrees(math.sqrt(variance)) < 2.0


def test_what_a_bent_elbow_told_of_the_moment_ends_with_the_bend() -> None:
    judge = AxialJudge(Tuning())
    for k in range(80):
        judge.add(START + k * 40 * MS, shown(math.radians(8.0 if k > 70 else 0.0), math.radians(90.0)), 0.1 * math.sin(k))
    assert judge.slip.astray_variance > 0.0
    judge.add(START + 81 * 40 * MS, shown(0.0, math.radians(10.0)), 0.0)
    assert judge.slip.astray_variance == 0.0


def test_a_stretched_elbow_says_nothing() -> None:
    assert session(0.3, 0.0, elbow_deg=10.0) == Slip()


@pytest.mark.parametrize("swing_deg", [(0.0, 0.0), (23.0, -17.0), (-40.0, 80.0), (0.0, 170.0)])
@pytest.mark.parametrize("twist_deg", [-120.0, 0.0, 17.0, 150.0])
def test_the_twist_is_that_about_the_arm(swing_deg: tuple[float, float], twist_deg: float) -> None:
    """However the arm has been swung, about an axis across it, the twist is what it was turned about itself."""
    swing = exp_so3(np.radians([*swing_deg, 0.0]))
    assert math.isclose(math.degrees(twist_rad(swing @ rot_z(math.radians(twist_deg)))), twist_deg, abs_tol=1e-9)
