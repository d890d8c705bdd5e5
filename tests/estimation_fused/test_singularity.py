"""The arm through the singularity of its angles: no NaN, no jump of the rotation."""

import itertools
import math

import numpy as np

from ghest_rt.geometry.so3 import angle_between_rad, quat_wxyz_from_matrix
from ghest_rt.messages.results import Status
from tests.estimation_fused.stand import Trial, rms_deg, run


def through_the_side(t: float) -> tuple[float, float, float]:
    """Straight to the side and beyond: b passes -90 deg at 1 s and comes back at 3 s."""
    return 0.1 * math.sin(t), math.radians(-90.0) + math.radians(30.0) * math.cos(math.pi * 0.5 * t), 0.2


def test_the_rotation_passes_the_singularity_of_its_angles_smoothly() -> None:
    judged = run(Trial(duration_s=4.0, angles=through_the_side))
    assert min(abs(j.estimate.gh_from_arm[1, 2] - 1.0) for j in judged if j.estimate.gh_from_arm is not None) < 1e-3
    shown = [j for j in judged if j.t_s > 0.5]
    assert all(j.estimate.status is not Status.LOST and j.estimate.gh_from_arm is not None for j in shown)
    assert rms_deg(judged, 0.5) < 0.2
    for before, after in itertools.pairwise(shown):
        R, covariance = after.estimate.gh_from_arm, after.estimate.covariance
        assert R is not None
        assert covariance is not None
        assert np.isfinite(R).all()
        assert np.isfinite(covariance).all()
        assert before.estimate.gh_from_arm is not None
        assert math.degrees(angle_between_rad(R, before.estimate.gh_from_arm)) < 1.2
        apart = quat_wxyz_from_matrix(before.estimate.gh_from_arm.T @ R)
        assert apart[0] > 0.9999
