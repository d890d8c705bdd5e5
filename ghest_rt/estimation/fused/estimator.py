"""The fused way: a filter over both markers and the encoders, its belief carried to the instant asked for."""

import math
from collections import Counter
from collections.abc import Mapping

import numpy as np

from ghest_drivers.samples import EncoderSample
from ghest_rt.estimation.arm import eq10_m0_from_arm, gh_from_arm_rotation, step3_4_5_e_from_arm
from ghest_rt.estimation.arm_chain import CAMERAS, ArmChain, lost
from ghest_rt.estimation.fused.axial import twist_rad
from ghest_rt.estimation.fused.belief import ARM, SIZE, Belief
from ghest_rt.estimation.fused.drift import DriftJudge
from ghest_rt.estimation.fused.filter import FusedFilter
from ghest_rt.estimation.fused.freshness import Freshness, encoders_overdue
from ghest_rt.estimation.fused.joints import JointForecast, Joints
from ghest_rt.estimation.fused.process import Process
from ghest_rt.estimation.fused.reference import Reference
from ghest_rt.estimation.fused.report import drift_report, rotation_covariance
from ghest_rt.estimation.fused.sighting import Sighting
from ghest_rt.estimation.fused.timeline import Timeline
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.estimation.fused.witness import Witness
from ghest_rt.estimation.inputs import NO_FRAMES, NOT_SEEN, Inputs
from ghest_rt.estimation.reasons import gravest
from ghest_rt.estimation.uncertainty import covariance_in_e, euler_sigma_rad
from ghest_rt.geometry.se3 import inverse
from ghest_rt.geometry.so3 import Array, log_so3, rot_z
from ghest_rt.kinematics.paper_chain import eq7_e_from_marker
from ghest_rt.messages.results import GhEstimate, MarkerObservation, MarkerStatus, Reason, Status
from ghest_rt.sync.encoder_track import EncoderTrack

# Both markers must have been seen within this time for the filter to start.
_START_NS = 100_000_000
# Nothing is bridged for longer, however certain it looks.
_LONGEST_BRIDGE_NS = 3_000_000_000
# A drift is compensated when the markers no longer contradict each other, and the rotation's standard deviation is below this
# share of the station's limit.
_SETTLED_SLACK = 10.0
_UNSETTLED = 0.2
# By how much a joint is moved to see how far it carries camera r1, rad or m.
_SMALL_STEP = 1e-4
_ARM_DIAGONAL = slice(ARM.start * (SIZE + 1), ARM.stop * (SIZE + 1), SIZE + 1)


class FusedEstimator:
    """Sections 3.3.2 to 3.3.5 as one estimation problem; an instant asked for may lie after everything that has arrived."""

    def __init__(
        self,
        chain: ArmChain,
        max_gap_ns: int,
        period_ns: Mapping[str, int],
        *,
        arm_length_m: float | None = None,
        reference: Reference | None = None,
        tuning: Tuning | None = None,
    ) -> None:
        """Start without samples.

        Args:
            chain: The station's geometry and calibration.
            max_gap_ns: The longest silence of the encoders that is bridged.
            period_ns: Nominal frame period of each camera.
            arm_length_m: Calibrated distance from elbow to GH centre, if known.
            reference: What the calibration session saw besides the markers.
            tuning: Takes the place of the noise and priors.
        """
        self._chain = chain
        self._tuning = tuning or Tuning()
        self._filter = FusedFilter(self._tuning, Process(self._tuning, chain.m1_from_elw[:3, 3]))
        self._arm_length_m, self._reference = arm_length_m, reference or Reference()
        self._judge, self._witness = self._fresh()
        self._unsettled_rad = _UNSETTLED * chain.sigma_limit_rad
        self._carried: Array | None = None
        self._inputs = Inputs(EncoderTrack(chain.limits), CAMERAS, max_gap_ns)
        self._joints = JointForecast(self._inputs.encoders, max_gap_ns)
        self._freshness = Freshness([period_ns[camera] for camera in CAMERAS])
        self._last: list[Sighting | None] = [None, None]
        self._gh_from_m0 = inverse(chain.m0_from_gh)
        self._timeline: Timeline | None = None
        self._counts: Counter[str] = Counter()
        self._default = np.diag(np.repeat((self._tuning.default_rotation_rad**2, self._tuning.default_position_m**2), 3))
        self._floor = np.diag(np.repeat((self._tuning.rotation_floor_rad**2, self._tuning.position_floor_m**2), 3))

    def add_encoder(self, sample: EncoderSample) -> None:
        """Take an encoder sample."""
        if self._inputs.add_encoder(sample):
            self._joints.add(sample)

    def add_marker(self, observation: MarkerObservation) -> None:
        """Take what became of a marker in a frame; one with a pose teaches the filter at its capture time."""
        if not self._inputs.add_frame(observation) or observation.camera_from_marker is None:
            return
        which = CAMERAS.index(observation.camera)
        self._freshness.saw(which, observation.t_arrival_ns - observation.t_capture_ns)
        sighting = self._sighting(observation, which)
        if sighting is None:
            self._counts[f"{observation.marker}_without_joints"] += 1
            return
        self._last[which] = sighting
        if self._timeline is None:
            self._start()
        else:
            self._timeline.add(sighting)
            if self._timeline.mistaken:
                self._timeline = None
                self._judge, self._witness = self._fresh()
                self._start()
                return
            belief = self._timeline.belief_at(sighting.t_ns)
            if belief is None or belief.seen_ns[which] != sighting.t_ns:
                return
            self._freshness.took(which, sighting.t_ns)
            if which:
                self._witness.compare(belief, sighting)

    def counts(self) -> dict[str, int]:
        """Return how many samples were not used, by reason."""
        return {**self._inputs.counts(), **{reason: n for reason, n in self._counts.items() if n}}

    def innovation(self, t_ns: int) -> float | None:
        """Return the normalised innovation squared (6 degrees of freedom) of the sighting taken at `t_ns`; None if unknown."""
        belief = None if self._timeline is None else self._timeline.belief_at(t_ns)
        return None if belief is None or belief.t_ns != t_ns else belief.nis

    def estimate(self, t_ns: int) -> GhEstimate:
        """Return the GH joint at `t_ns`, forecast where nothing newer has come, or why there is none."""
        joints = self._joints.at(t_ns)
        known = None if self._timeline is None else self._timeline.belief_at(t_ns)
        if known is None or joints is None:
            return lost(t_ns, self._why_nothing(t_ns), self._inputs.newest_ns)
        belief = known.copy()
        self._forecast(belief, t_ns, joints)
        stale = self._freshness.stale(belief.seen_ns, t_ns)
        posture = self._judge.judge(belief, self._witness.evidence(belief))
        e_from_arm = step3_4_5_e_from_arm(posture.e_from_gh, posture.e_from_elw)
        newest_ns = {**self._inputs.newest_ns, "r0": belief.seen_ns[0], "r1": belief.seen_ns[1], "encoders": joints.newest_ns}
        if e_from_arm is None:
            return lost(t_ns, self._why_unseen(stale, t_ns) if stale else Reason.UNCERTAIN, newest_ns)
        m0_from_gh = self._chain.m0_from_gh
        m0_from_arm = eq10_m0_from_arm(posture.e_from_gh.dot(self._gh_from_m0), e_from_arm)
        gh_from_arm = gh_from_arm_rotation(m0_from_gh, m0_from_arm)
        slip = self._witness.slip.explained(posture.turned)
        slip_rad, slip_variance = slip.at(twist_rad(gh_from_arm))
        covariance, of_arm = rotation_covariance(posture), posture.covariance[ARM, ARM]
        if slip_rad or slip_variance:
            slipped = rot_z(slip_rad)
            m0_from_arm[:3, :3] = m0_from_arm[:3, :3] @ slipped
            gh_from_arm = gh_from_arm @ slipped
            e_from_arm[:3, :3] = e_from_arm[:3, :3] @ slipped
            covariance = covariance + slip_variance * np.outer(gh_from_arm[:, 2], gh_from_arm[:, 2])
            of_arm = of_arm + slip_variance * np.outer(e_from_arm[:3, 2], e_from_arm[:3, 2])
        if stale and self._given_up(belief, t_ns, covariance):
            return lost(t_ns, self._why_unseen(stale, t_ns), newest_ns)
        drift = drift_report(posture, slip, self._chain.m1_from_elw[:3, 1])
        elbow = self._chain.elbow_angles(e_from_arm, joints.positions, of_arm)
        flagged = drift.m0.flagged or drift.m1.flagged
        unsettled = belief.slack > _SETTLED_SLACK or math.sqrt(sum(covariance.diagonal().tolist())) > self._unsettled_rad
        bridged = bool(stale) or self._freshness.returning() or encoders_overdue(joints.gap_ns)
        reason = self._weakness(gh_from_arm, covariance, bridged, flagged and unsettled)
        return GhEstimate(
            t_sample_ns=t_ns,
            status=Status.VALID if reason is Reason.NONE else Status.DEGRADED,
            reason=reason,
            gh_from_arm=gh_from_arm,
            m0_from_arm=m0_from_arm,
            e_from_m0=belief.e_from(0),
            e_from_m1=belief.e_from(1),
            covariance=covariance,
            newest_ns=newest_ns,
            drift=drift,
            elbow=elbow,
        )

    def _sighting(self, observation: MarkerObservation, which: int) -> Sighting | None:
        joints = self._joints.at(observation.t_capture_ns)
        if joints is None or observation.camera_from_marker is None:
            return None
        e_from_r1 = self._e_from_r1(joints.positions)
        e_from_camera = e_from_r1 if which else self._chain.e_from_camera(CAMERAS[0], joints.positions)
        covariance = self._default if observation.covariance is None else observation.covariance + self._floor
        covariance = covariance_in_e(covariance, e_from_camera)
        if self._chain.needs_encoders(observation.camera):
            turn, place = self._encoder_variance(joints)
            diagonal = covariance.ravel()[::7]
            diagonal[:3] += self._tuning.encoder_rad**2 + turn
            diagonal[3:] += self._tuning.encoder_m**2 + place
        return Sighting(
            marker=which,
            t_ns=observation.t_capture_ns,
            pose=eq7_e_from_marker(e_from_camera, observation.camera_from_marker),
            covariance=covariance,
            e_from_r1=e_from_r1,
            color_only=observation.status is MarkerStatus.COLOR_ONLY,
            fewer_disks=0 < observation.disks_used < 4,
            joints=joints.positions,
        )

    def _forecast(self, belief: Belief, t_ns: int, joints: Joints) -> None:
        """Move a belief on to an instant that may lie after everything that has arrived."""
        if t_ns <= belief.t_ns:
            return
        self._filter.process.advance(belief, t_ns, self._e_from_r1(joints.positions), doubt=self._tuning.forecast_doubt)
        turn, place = self._encoder_variance(joints)
        upper_arm = belief.gh_in_marker[1] - self._chain.m1_from_elw[:3, 3]
        diagonal = belief.P.ravel()[_ARM_DIAGONAL]
        diagonal += turn + place / float(upper_arm @ upper_arm)

    def _fresh(self) -> tuple[DriftJudge, Witness]:
        """Return what knows nothing of the session yet."""
        chain, tuning = self._chain, self._tuning
        judge = DriftJudge(tuning, chain.m0_from_gh, chain.m1_from_elw, self._arm_length_m)
        return judge, Witness(chain, tuning, self._reference)

    def _start(self) -> None:
        m0, m1 = self._last
        if m0 is not None and m1 is not None and abs(m0.t_ns - m1.t_ns) <= _START_NS:
            self._timeline = Timeline(self._filter, self._filter.start(m0, m1, self._chain.m0_from_gh), self._counts)

    def _encoder_variance(self, joints: Joints) -> tuple[float, float]:
        """Return what the joints' variance means for camera r1: of its rotation (rad^2) and place (m^2), per axis.

        How far each joint carries the camera is measured once, in the first posture: directions change, distances hardly.
        """
        if self._carried is None:
            here = self._e_from_r1(joints.positions)
            there = [self._e_from_r1(joints.positions + step) for step in _SMALL_STEP * np.eye(len(joints.positions))]
            turns = [float(np.sum(np.square(log_so3(T[:3, :3] @ here[:3, :3].T)))) for T in there]
            places = [float(np.sum(np.square(T[:3, 3] - here[:3, 3]))) for T in there]
            self._carried = np.array([turns, places]) / (3.0 * _SMALL_STEP**2)
        turn, place = self._carried.dot(joints.variance).tolist()
        return turn, place

    def _e_from_r1(self, positions: Array) -> Array:
        return self._chain.e_from_camera(CAMERAS[1], positions)

    def _given_up(self, belief: Belief, t_ns: int, covariance: Array) -> bool:
        too_long = t_ns - min(belief.seen_ns) > _LONGEST_BRIDGE_NS
        return too_long or math.sqrt(float(np.linalg.eigvalsh(covariance)[-1])) > self._chain.sigma_limit_rad

    def _why_unseen(self, stale: tuple[int, ...], t_ns: int) -> Reason:
        reasons = []
        for which in stale:
            newest = self._inputs.frames[CAMERAS[which]].before(t_ns)
            # A marker in frames that come, but not where it can be, is not seen either.
            unseen = newest is not None and t_ns - newest[0] <= _START_NS
            reasons.append((NOT_SEEN if unseen else NO_FRAMES)[CAMERAS[which]])
        return gravest(*reasons)

    def _why_nothing(self, t_ns: int) -> Reason:
        without_joints = self._inputs.why_no_joints(t_ns) if self._joints.at(t_ns) is None else None
        if without_joints is not None:
            return without_joints
        missing = [camera for camera, sighting in zip(CAMERAS, self._last, strict=True) if sighting is None]
        reasons = [self._inputs.why_no_pose(camera, t_ns, needs_encoders=False) for camera in missing]
        return gravest(*reasons) if reasons else Reason.STARTING

    def _weakness(self, gh_from_arm: Array, covariance: Array, bridged: bool, drifting: bool) -> Reason:
        """Return the gravest reason why angles that are there are not plainly valid.

        Args:
            gh_from_arm: (3, 3) rotation.
            covariance: (3, 3) of its error.
            bridged: Whether an input is missing.
            drifting: Whether a marker has drifted, and it is not yet clear by how much.
        """
        sigma_rad = max(euler_sigma_rad(gh_from_arm, covariance))
        if sigma_rad > self._chain.sigma_limit_rad:
            return Reason.UNCERTAIN
        last = [sighting for sighting in self._last if sighting is not None]
        if any(sighting.color_only for sighting in last):
            return Reason.COLOR_ONLY
        if any(sighting.fewer_disks for sighting in last):
            return Reason.FEWER_DISKS
        if bridged:
            return Reason.BRIDGED
        return Reason.MARKER_DRIFT if drifting else Reason.NONE
