"""What the exoskeleton tells beside the cameras: where it has the elbow, and where the forearm points."""

import numpy as np

from ghest_rt.estimation.arm import ELW_FROM_ARM
from ghest_rt.estimation.arm_chain import ArmChain
from ghest_rt.estimation.fused.axial import AxialJudge, Slip, twist_rad
from ghest_rt.estimation.fused.belief import Belief
from ghest_rt.estimation.fused.drift import Evidence
from ghest_rt.estimation.fused.reference import Reference
from ghest_rt.estimation.fused.settled import Settled
from ghest_rt.estimation.fused.sighting import Sighting
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.so3 import Array, log_so3

# Elbow and forearm are compared with m1 this often: their disagreement is slow.
_COMPARE_NS = 40_000_000


class Witness:
    """Holds elbow and forearm of the exoskeleton against m1, since the beginning of the session and since the calibration."""

    def __init__(self, chain: ArmChain, tuning: Tuning, reference: Reference) -> None:
        """Start without sightings.

        Args:
            chain: The station's geometry and calibration.
            tuning: Priors.
            reference: The calibration session.
        """
        self._chain = chain
        self._tuning = tuning
        self._reference = reference
        self._axial = AxialJudge(tuning, reference)
        # The elbow in camera r1 as m1 shows it, and the attitude of the arm there.
        self._elbow = Settled(6, tuning.reference_s, tuning.elbow_memory_s)
        self._first_r1_from_m1: Array | None = None
        self._compared_ns = 0

    @property
    def slip(self) -> Slip:
        """How m1 slips about the arm."""
        return self._axial.slip

    def compare(self, belief: Belief, sighting: Sighting) -> None:
        """Note where the exoskeleton has the elbow; let the forearm judge whether m1 slips about the arm.

        Args:
            belief: With the sighting.
            sighting: Of m1, one that the filter has taken.
        """
        if sighting.t_ns - self._compared_ns < _COMPARE_NS:
            return
        self._compared_ns = sighting.t_ns
        base, R = belief.base[1], sighting.pose[:3, :3]
        elbow = sighting.pose[:3, 3] + R @ (base.turn.T @ (self._chain.m1_from_elw[:3, 3] - base.slide))
        r1_from_e = sighting.e_from_r1[:3, :3].T
        r1_from_m1 = r1_from_e @ R @ base.turn.T
        if self._first_r1_from_m1 is None:
            self._first_r1_from_m1 = r1_from_m1
        attitude = log_so3(r1_from_m1 @ self._first_r1_from_m1.T)
        self._elbow.add(sighting.t_ns, np.concatenate((r1_from_e @ (elbow - sighting.e_from_r1[:3, 3]), attitude)))
        forearm = self._chain.forearm_in_e(sighting.joints)
        if forearm is None:
            return
        elw_from_e = self._chain.m1_from_elw[:3, :3].T @ base.turn @ R.T
        gh_from_e = self._chain.m0_from_gh[:3, :3].T @ belief.base[0].turn @ belief.e_from_marker[0].T
        gh_from_arm = gh_from_e @ elw_from_e.T @ ELW_FROM_ARM
        self._axial.add(sighting.t_ns, elw_from_e @ forearm, twist_rad(gh_from_arm))

    def evidence(self, belief: Belief) -> Evidence:
        """Return what is told of m1, in its axes as calibrated."""
        marker_from_r1 = belief.base[1].turn.dot(belief.e_from_marker[1].T).dot(belief.e_from_r1[:3, :3])
        elbow, reference = self._elbow, self._reference
        moved = first = None
        moved_m2 = 0.0
        if elbow.ready:
            # It wanders with the arm's attitude in r1: the arm's axis and the exoskeleton's are apart.
            apart = elbow.recent - elbow.first
            moved = marker_from_r1.dot(apart[:3])
            moved_m2 = self._tuning.elbow_m**2 + self._tuning.elbow_lever_m**2 * float(apart[3:].dot(apart[3:]))
        if elbow.started and reference.elbow_m is not None:
            first = marker_from_r1 @ (elbow.first[:3] - reference.elbow_m)
        twist_rad, twist_rad2 = self._axial.turned() or (None, 0.0)
        return Evidence(moved, moved_m2, first, reference.elbow_sigma_m**2, twist_rad, twist_rad2)
