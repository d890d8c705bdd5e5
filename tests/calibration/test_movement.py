"""Movement CAL is the session that docs/calibration.md asks for."""

import math

import numpy as np
import pytest

from ghest_rt.calibration.verdict import LEAST_RANGE_RAD
from ghest_rt.estimation.angles import euler_yxz
from ghest_rt.simulation.calibration_motion import CalibrationMotion


@pytest.mark.parametrize("seed", [0, 1, 7])
def test_the_neutral_posture_is_held_for_four_seconds_with_the_elbow_bent(seed: int) -> None:
    motion = CalibrationMotion(seed)
    for t_s in np.arange(-0.2, 4.0, 0.05):
        posture = motion.at(float(t_s))
        angles = euler_yxz(posture.gh)
        assert max(abs(angles.a_rad), abs(angles.b_rad), abs(angles.g_rad)) < math.radians(0.5)
        assert posture.elbow_rad[0] == pytest.approx(math.radians(90.0), abs=math.radians(0.5))


@pytest.mark.parametrize("seed", [0, 1, 7])
def test_every_angle_moves_far_enough_and_smoothly_and_ends_where_it_began(seed: int) -> None:
    motion = CalibrationMotion(seed)
    assert 20.0 < motion.duration_s < 40.0
    times = np.arange(0.0, motion.duration_s + 0.2, 0.02)
    angles = np.array([(e.a_rad, e.b_rad, e.g_rad) for e in (euler_yxz(motion.at(float(t)).gh) for t in times)])
    assert (np.ptp(angles, axis=0) > 2.0 * LEAST_RANGE_RAD).all()
    assert np.abs(np.diff(angles, axis=0)).max() < math.radians(1.6)  # 80 degrees a second
    assert np.abs(angles[-1]).max() < math.radians(0.5)


def test_another_seed_is_another_session_and_the_same_one_is_not() -> None:
    there, again, other = CalibrationMotion(3), CalibrationMotion(3), CalibrationMotion(4)
    assert there.at(9.0).gh.tolist() == again.at(9.0).gh.tolist()
    assert there.duration_s != other.duration_s
