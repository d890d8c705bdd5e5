"""What the calibration session saw besides the markers, held against this session; section 6 of docs/fused-estimator.md.

The elbow's place in the link of camera r1 tells a turn of m1 from a slide. The scapula's attitude in the neutral posture tells
turns of m0 that leave the GH centre where it is. It turns with the arm: by how much is learned from the movement.
"""

import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.config.station import Calibration
from ghest_rt.estimation.fused.belief import Belief
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.so3 import Array, exp_so3, log_so3

# Sightings farther apart than this are not joined, s.
_GAP_S = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """The calibration session, `[calibration.reference]` of the station file.

    Attributes:
        elbow_m: (3,) the elbow in camera r1, m; None where it is not known.
        elbow_sigma_m: Standard deviation of that from session to session, per axis.
        forearm_rad: How the forearm stood out of the elbow frame's y-z plane; None where it is not known.
        forearm_sigma_rad: Standard deviation of that.
        e_from_gh: (3, 3) attitude of the scapula in the neutral posture; None where it is not known.
        scapula_sigma_rad: Standard deviation of that, per axis.
    """

    elbow_m: Array | None = None
    elbow_sigma_m: float = 0.0
    forearm_rad: float | None = None
    forearm_sigma_rad: float = 0.0
    e_from_gh: Array | None = None
    scapula_sigma_rad: float = 0.0

    @classmethod
    def of(cls, calibration: Calibration) -> "Reference":
        """Return what a station file says."""
        said = calibration.reference
        elbow_m = None
        if said.elbow_in_link_m is not None:
            link_from_r1 = calibration.link_from_camera_array("r1")
            elbow_m = link_from_r1[:3, :3].T @ (np.array(said.elbow_in_link_m) - link_from_r1[:3, 3])
        turn_deg = said.scapula_turn_deg
        return cls(
            elbow_m=elbow_m,
            elbow_sigma_m=said.elbow_sigma_m,
            forearm_rad=None if said.forearm_twist_deg is None else math.radians(said.forearm_twist_deg),
            forearm_sigma_rad=math.radians(said.forearm_sigma_deg),
            e_from_gh=None if turn_deg is None else exp_so3(np.radians(turn_deg)),
            scapula_sigma_rad=math.radians(said.scapula_sigma_deg),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """How this session differs from the calibration session.

    Attributes:
        scapula: (3,) how far m0 has turned by the scapula's attitude, rotation vector, axes of m0 as calibrated, rad; or None.
        scapula_rad2: Variance of that without a turn, per axis.
        elbow: (3,) how far the elbow, as m1 shows it, was displaced in camera r1 during the first seconds, axes of m1 as
            calibrated, m; or None.
        elbow_m2: Variance of that without drift, per axis.
        twist_rad: How far m1 has turned about the arm's axis (elbow to GH centre) by the forearm; or None.
        twist_rad2: Variance of that without a turn.
    """

    scapula: Array | None = None
    scapula_rad2: float = 0.0
    elbow: Array | None = None
    elbow_m2: float = 0.0
    twist_rad: float | None = None
    twist_rad2: float = 0.0


NO_EVIDENCE = Evidence()


class Comparison:
    """Holds a session against the calibration session.

    The scapula's turning away from the reference is regressed on where the arm points, V: turn = constant + S (Vx, Vy), with a
    prior for the rhythm S (the scapula follows the arm by some tenths) and a forgetting factor. The constant is what counts.
    """

    def __init__(self, reference: Reference, tuning: Tuning, m0_from_gh: Array, m1_from_elw: Array) -> None:
        """Start without samples.

        Args:
            reference: The calibration session.
            tuning: Priors.
            m0_from_gh: (4, 4) GH joint frame in the m0 frame, equation (8).
            m1_from_elw: (4, 4) elbow frame in the m1 frame, equation (9).
        """
        self._reference = reference
        self._tuning = tuning
        self._m0_from_gh, self._along = m0_from_gh[:3, :3], m1_from_elw[:3, 1]
        self._prior = np.diag((0.0, 1.0, 1.0)) / tuning.rhythm_sigma**2
        self._squares = np.zeros((3, 3))
        self._products = np.zeros((3, 3))
        self._scapula: Array | None = None
        self._scapula_rad2 = 0.0
        self._t_ns: int | None = None

    def add(self, belief: Belief) -> None:
        """Take what is believed at a sighting."""
        reference = self._reference.e_from_gh
        if reference is None:
            return
        dt = 0.0 if self._t_ns is None else (belief.t_ns - self._t_ns) * 1e-9
        self._t_ns = belief.t_ns
        if not 0.0 < dt <= _GAP_S:
            return
        m0, m1 = (R @ base.turn.T for R, base in zip(belief.e_from_marker, belief.base, strict=True))
        turned = self._m0_from_gh @ log_so3(reference.T @ m0 @ self._m0_from_gh)
        x, y, _ = m1 @ self._along
        where = np.array([1.0, x, y])
        # Samples within the memory of the scapula's wander are one sample.
        information = dt / (self._tuning.wander_memory_s * self._tuning.scapula_wander_rad**2)
        kept = math.exp(-dt / self._tuning.rhythm_memory_s)
        self._squares = kept * self._squares + information * np.outer(where, where)
        self._products = kept * self._products + information * np.outer(where, turned)
        inverse = np.linalg.inv(self._squares + self._prior)
        self._scapula = inverse[0] @ self._products
        self._scapula_rad2 = float(inverse[0, 0]) + self._reference.scapula_sigma_rad**2

    def evidence(self, belief: Belief, first_elbow: Array | None, twist: tuple[float, float] | None) -> Evidence:
        """Return how this session differs.

        Args:
            belief: The belief.
            first_elbow: (3,) the elbow in camera r1 during the first seconds, m; None before there is any.
            twist: How far m1 has turned about the arm by the forearm, and the variance of that; rad, rad^2.
        """
        reference = self._reference
        elbow = None
        if reference.elbow_m is not None and first_elbow is not None:
            in_e = belief.e_from_r1[:3, :3] @ (first_elbow - reference.elbow_m)
            elbow = np.asarray(belief.base[1].turn @ (belief.e_from_marker[1].T @ in_e))
        return Evidence(self._scapula, self._scapula_rad2, elbow, reference.elbow_sigma_m**2, *(twist or (None, 0.0)))
