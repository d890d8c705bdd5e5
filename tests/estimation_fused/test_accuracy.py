"""How near the published angles are, and whether the stated uncertainty is true."""

import math

import numpy as np
import pytest

from ghest_rt.geometry.so3 import log_so3
from ghest_rt.messages.results import Status
from tests.estimation_fused.stand import Judged, Trial, rest, rms_deg, run


def jitter_deg(judged: list[Judged]) -> float:
    """RMS distance of the estimates from their middle one, over a stretch at rest."""
    found = [j.estimate.gh_from_arm for j in judged if j.t_s > 2.0 and j.estimate.gh_from_arm is not None]
    errors = np.array([log_so3(R @ found[0].T) for R in found])
    return math.degrees(float(np.sqrt(np.mean(np.sum((errors - errors.mean(axis=0)) ** 2, axis=1)))))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_angles_are_right_at_the_instant_they_are_published(seed: int) -> None:
    """Frames come 20 to 40 ms late; 0.35 deg is asked for, and the intervals shall mean what they say.

    93 to 97 % inside is the aim over all movements; this one is smoother than people are, and comes out at 97 to 98 %.
    """
    judged = [j for j in run(Trial(seed=seed)) if j.t_s > 0.5]
    assert rms_deg(judged, 0.5) < 0.16
    assert max(j.error_deg for j in judged) < 0.45
    errors = np.array([j.error_rad for j in judged])
    covariances = np.array([j.estimate.covariance for j in judged])
    inside = np.abs(errors) < 1.96 * np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    assert 0.93 <= inside.mean() <= 0.985
    nees = np.einsum("ni,ni->n", errors, np.linalg.solve(covariances, errors[:, :, None])[:, :, 0])
    assert 0.6 < nees.mean() / 3.0 < 1.3
    assert np.mean([j.estimate.status is Status.VALID for j in judged]) > 0.99


def test_better_sensors_give_better_angles_and_smaller_sigmas() -> None:
    coarse = [j for j in run(Trial(duration_s=5.0, rotation_deg=0.2, position_mm=0.2)) if j.t_s > 0.5]
    fine = [j for j in run(Trial(duration_s=5.0, rotation_deg=0.02, position_mm=0.02)) if j.t_s > 0.5]
    assert rms_deg(fine, 0.5) < 0.4 * rms_deg(coarse, 0.5)
    assert np.median([j.sigma_deg for j in fine]) < 0.4 * np.median([j.sigma_deg for j in coarse])


def test_at_rest_it_trembles_half_as_much_as_the_refined_way() -> None:
    refined = jitter_deg(run(Trial(angles=rest, method="refined", lag_ms=60.0)))
    assert jitter_deg(run(Trial(angles=rest))) < 0.5 * refined


def test_an_instant_in_the_past_is_told_as_it_was() -> None:
    """A service that still waits 45 ms gets estimates for the instant it asks for, not for the newest frame's."""
    judged = run(Trial(duration_s=4.0, lag_ms=60.0))
    assert rms_deg(judged, 0.5) < 0.12
