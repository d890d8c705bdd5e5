"""What is told of a posture: drift and uncertainty."""

import numpy as np

from ghest_rt.estimation.fused.answers import DRIFT_SIZE, SLIDE, TURN
from ghest_rt.estimation.fused.axial import Slip
from ghest_rt.estimation.fused.belief import ACROMION, ARM
from ghest_rt.estimation.fused.drift import Posture
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import DriftReport, MarkerDrift

# A marker has drifted if that is likelier than not.
_FLAG = 0.5


def drift_report(posture: Posture, slip: Slip, along: Array) -> DriftReport:
    """Return the drift of both markers, that of m1 with its slip about the arm.

    Args:
        posture: The bones and the drift.
        slip: How m1 has slipped about the arm.
        along: (3,) the arm's direction in m1, unit vector.
    """
    sigma = np.sqrt(posture.covariance.diagonal()[-DRIFT_SIZE:])
    m0 = MarkerDrift(
        flagged=posture.drifted[0] > _FLAG,
        probability=posture.drifted[0],
        slide_m=posture.slide[0],
        slide_sigma_m=sigma[SLIDE[0]],
        turn_rad=posture.turn[0],
        turn_sigma_rad=sigma[TURN[0]],
    )
    turn, turn_sigma = posture.turn[1], sigma[TURN[1]]
    slip_rad, slip_variance = slip.shift_rad + slip.offset_rad, slip.shift_variance + slip.offset_variance
    if slip_rad or slip_variance:
        turn, turn_sigma = turn - slip_rad * along, np.sqrt(np.square(turn_sigma) + slip_variance * np.square(along))
    probability = 1.0 - (1.0 - posture.drifted[1]) * (1.0 - slip.shifted) * (1.0 - slip.offset_there)
    m1 = MarkerDrift(
        flagged=probability > _FLAG,
        probability=probability,
        slide_m=posture.slide[1],
        slide_sigma_m=sigma[SLIDE[1]],
        turn_rad=turn,
        turn_sigma_rad=turn_sigma,
    )
    return DriftReport(m0, m1)


def rotation_covariance(posture: Posture) -> Array:
    """Return the (3, 3) covariance of the error of gh_from_arm: epsilon = gh_from_e (phi_humerus - phi_scapula)."""
    P, gh_from_e = posture.covariance, posture.e_from_gh[:3, :3].T
    cross = P[ACROMION, ARM]
    return np.asarray(gh_from_e.dot(P[ACROMION, ACROMION] + P[ARM, ARM] - cross - cross.T).dot(gh_from_e.T))
