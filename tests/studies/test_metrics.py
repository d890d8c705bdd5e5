"""The paper's metrics on made-up estimates whose error is known."""

import math

import numpy as np
import pytest

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3
from ghest_rt.messages.results import GhEstimate, Reason, Status, TruthSample
from ghest_rt.studies.metrics import ErrorAccumulator
from ghest_rt.studies.truth import TruthTrack


def truth(t_ns: int, angle_rad: float = 0.0, x_m: float = 0.0) -> TruthSample:
    pose = transform(exp_so3(np.array([0.0, angle_rad, 0.0])), [x_m, 0.1, -0.2])
    return TruthSample(t_ns, pose[:3, :3], pose, pose, pose, pose, {"j0": angle_rad})


def estimate(t_ns: int, error_rad: np.ndarray, error_m: np.ndarray, status: Status = Status.VALID) -> GhEstimate:
    exact = truth(t_ns)
    R = exp_so3(error_rad) @ exact.gh_from_arm
    pose = transform(R, exact.m0_from_arm[:3, 3] + error_m)
    return GhEstimate(t_ns, status, Reason.NONE, R, pose, pose, pose, None, {})


def lost(t_ns: int) -> GhEstimate:
    return GhEstimate(t_ns, Status.LOST, Reason.M0_NOT_SEEN, None, None, None, None, None, {})


def test_rms_of_known_errors() -> None:
    accumulator = ErrorAccumulator()
    for k, degrees in enumerate((1.0, 3.0)):
        accumulator.add(estimate(k, np.array([math.radians(degrees), 0, 0]), np.array([0, 0.003, 0.004])), truth(k))
    rms = accumulator.rms()
    assert math.degrees(rms.orientation_rad) == pytest.approx(math.sqrt(5.0))
    assert rms.position_m == pytest.approx(0.005)
    assert rms.m0_m == pytest.approx(0.005)
    assert accumulator.valid_fraction == 1.0


def test_lost_and_degraded_samples_lower_the_valid_fraction_but_only_samples_with_angles_are_judged() -> None:
    accumulator = ErrorAccumulator()
    accumulator.add(estimate(0, np.zeros(3), np.zeros(3)), truth(0))
    accumulator.add(estimate(1, np.zeros(3), np.zeros(3), Status.DEGRADED), truth(1))
    accumulator.add(lost(2), truth(2))
    accumulator.add(estimate(3, np.zeros(3), np.zeros(3)), None)
    assert (accumulator.samples, accumulator.judged) == (4, 2)
    assert accumulator.valid_fraction == 0.5


def test_nothing_judged_is_nan_not_zero() -> None:
    accumulator = ErrorAccumulator()
    accumulator.add(lost(0), truth(0))
    assert math.isnan(accumulator.rms().orientation_rad)


def test_truth_is_interpolated_between_samples_and_absent_outside() -> None:
    track = TruthTrack()
    track.add(truth(100, 0.0, 0.0))
    track.add(truth(200, 0.4, 1.0))
    track.add(truth(150, 9.0, 9.0))  # out of order: ignored
    middle = track.at(150)
    assert middle is not None
    assert middle.m0_from_arm[0, 3] == pytest.approx(0.5)
    np.testing.assert_allclose(middle.gh_from_arm, exp_so3(np.array([0.0, 0.2, 0.0])), atol=1e-14)
    assert middle.joints_rad["j0"] == pytest.approx(0.2)
    exact = track.at(200)
    assert exact is not None
    assert exact.m0_from_arm[0, 3] == 1.0
    assert track.at(99) is None
    assert track.at(201) is None
