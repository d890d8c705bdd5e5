"""Equations (6) to (10) for one station: from marker observations and joint positions to a `GhEstimate`."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ghest_rt.config.station import StationConfig
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.arm import (
    eq8_e_from_gh,
    eq9_e_from_elw,
    eq10_m0_from_arm,
    gh_from_arm_rotation,
    step3_4_5_e_from_arm,
)
from ghest_rt.estimation.elbow import ElbowGeometry
from ghest_rt.estimation.uncertainty import covariance_in_e, euler_sigma_rad, rotation_jacobians
from ghest_rt.geometry.so3 import Array
from ghest_rt.kinematics.forward import ForwardKinematics
from ghest_rt.kinematics.paper_chain import eq6_e_from_camera, eq7_e_from_marker
from ghest_rt.messages.results import ElbowAngles, GhEstimate, MarkerObservation, MarkerStatus, Reason, Status
from ghest_rt.sync.encoder_track import JointState
from ghest_rt.sync.pose_track import PoseSample

CAMERAS = ("r0", "r1")

# Encoder samples farther apart than this are a gap: no known link is slower than 40 Hz.
_ENCODER_BRIDGE_NS = 40_000_000


class ArmChain:
    """The station's geometry and calibration, and the paper's chain through them.

    Attributes:
        limits: (n, 2) limits of the measured joints, rad or m.
        m0_from_gh: (4, 4) GH joint frame in the m0 frame, by calibration.
        m1_from_elw: (4, 4) elbow frame in the m1 frame, by calibration.
        sigma_limit_rad: The station's limit on a standard deviation.
    """

    def __init__(self, config: StationConfig, urdf_text: str, source: str, encoder_joints: Sequence[str]) -> None:
        """Read geometry and calibration.

        Raises:
            BadInputError: The encoder link's joints are not the station file's, or the URDF does not fit.
        """
        if tuple(encoder_joints) != config.encoders.joints:
            raise BadInputError(
                f"encoders.joints is {', '.join(config.encoders.joints)}, but the link sends {', '.join(encoder_joints)}; "
                "make the station file agree with the link, in the same order"
            )
        self._link = {camera: config.cameras[camera].link for camera in CAMERAS}
        forearm = () if config.elbow is None else (config.elbow.link,)
        self._fk = ForwardKinematics(
            urdf_text,
            source,
            base_link=config.exoskeleton.base_link,
            links=(*self._link.values(), *forearm),
            settings_m=config.exoskeleton.settings_m,
            measured_joints=encoder_joints,
        )
        self.limits = self._fk.limits
        self._elbow = (
            None if config.elbow is None else ElbowGeometry(config.elbow, config.station.arm, self._fk, encoder_joints)
        )
        self._link_from_camera = {camera: config.calibration.link_from_camera_array(camera) for camera in CAMERAS}
        self.m0_from_gh = np.array(config.calibration.m0_from_gh)
        self.m1_from_elw = np.array(config.calibration.m1_from_elw)
        self.sigma_limit_rad = math.radians(config.estimator.sigma_limit_deg)
        self._still_camera = {
            camera: eq6_e_from_camera(self._fk.link_pose(link, np.zeros(len(encoder_joints))), self._link_from_camera[camera])
            for camera, link in self._link.items()
            if not self._fk.moves(link)
        }

    def needs_encoders(self, camera: str) -> bool:
        """Say whether a camera's pose depends on the encoders (that of a camera on the base does not)."""
        return camera not in self._still_camera

    def e_from_camera(self, camera: str, joint_positions: Array) -> Array:
        """Return a camera in E, equation (6): (4, 4), metres.

        Args:
            camera: The camera.
            joint_positions: (n,) rad (m for prismatic joints); not used where the camera stands still.
        """
        still = self._still_camera.get(camera)
        if still is not None:
            return still
        return eq6_e_from_camera(self._fk.link_pose(self._link[camera], joint_positions), self._link_from_camera[camera])

    def forearm_in_e(self, joint_positions: Array) -> Array | None:
        """Return the (3,) direction of the forearm in E, elbow to wrist; None where it is not on the exoskeleton.

        Args:
            joint_positions: (n,) rad (m for prismatic joints).
        """
        return None if self._elbow is None else self._elbow.forearm_in_e(joint_positions)

    def marker_in_e(self, observation: MarkerObservation, joints: JointState | None) -> PoseSample | None:
        """Return a marker's pose in E, equations (6) and (7).

        Args:
            observation: The marker in its camera.
            joints: The joints when the frame was taken; not used where the camera stands still.

        Returns:
            The pose at the frame's capture time; None if the observation has none, or joints are needed and missing.
        """
        if observation.camera_from_marker is None:
            return None
        camera = observation.camera
        e_from_camera = self._still_camera.get(camera)
        if e_from_camera is None:
            if joints is None:
                return None
            e_from_camera = self.e_from_camera(camera, joints.positions)
        else:
            joints = None
        return PoseSample(
            t_ns=observation.t_capture_ns,
            e_from_marker=eq7_e_from_marker(e_from_camera, observation.camera_from_marker),
            covariance=None if observation.covariance is None else covariance_in_e(observation.covariance, e_from_camera),
            color_only=observation.status is MarkerStatus.COLOR_ONLY,
            fewer_disks=0 < observation.disks_used < 4,
            bridged=joints is not None and joints.gap_ns > _ENCODER_BRIDGE_NS,
            newest_ns=observation.t_capture_ns,
            encoders_ns=None if joints is None else joints.newest_ns,
        )

    def estimate(
        self, t_ns: int, m0: PoseSample, m1: PoseSample, newest_ns: Mapping[str, int], joints: JointState | None
    ) -> GhEstimate:
        """Return the GH joint from the two markers in E, equations (8) to (10), with status and covariance.

        Args:
            t_ns: The instant it shall hold for.
            m0: Marker m0 in E.
            m1: Marker m1 in E.
            newest_ns: Time of the newest sample seen of each input.
            joints: The joints at `t_ns`, for the elbow; None if they are not known.
        """
        used_ns = {**newest_ns, "r0": m0.newest_ns, "r1": m1.newest_ns}
        encoders_ns = [ns for ns in (m0.encoders_ns, m1.encoders_ns) if ns is not None]
        if encoders_ns:
            used_ns["encoders"] = max(encoders_ns)
        e_from_gh = eq8_e_from_gh(m0.e_from_marker, self.m0_from_gh)
        e_from_elw = eq9_e_from_elw(m1.e_from_marker, self.m1_from_elw)
        e_from_arm = step3_4_5_e_from_arm(e_from_gh, e_from_elw)
        if e_from_arm is None:
            return lost(t_ns, Reason.UNCERTAIN, used_ns)
        m0_from_arm = eq10_m0_from_arm(m0.e_from_marker, e_from_arm)
        gh_from_arm = gh_from_arm_rotation(self.m0_from_gh, m0_from_arm)
        covariance = of_arm = None
        if m0.covariance is not None and m1.covariance is not None:
            J_0, J_1 = rotation_jacobians(m0.e_from_marker, m1.e_from_marker, e_from_gh, e_from_elw, e_from_arm)
            covariance = J_0 @ m0.covariance @ J_0.T + J_1 @ m1.covariance @ J_1.T
            of_arm = self._covariance_of_arm(e_from_gh[:3, :3] @ J_0, e_from_gh[:3, :3] @ J_1, m0.covariance, m1.covariance)
        elbow = None if joints is None else self.elbow_angles(e_from_arm, joints.positions, of_arm)
        reason = self._weakness(m0, m1, gh_from_arm, covariance)
        return GhEstimate(
            t_sample_ns=t_ns,
            status=Status.VALID if reason is Reason.NONE else Status.DEGRADED,
            reason=reason,
            gh_from_arm=gh_from_arm,
            m0_from_arm=m0_from_arm,
            e_from_m0=m0.e_from_marker,
            e_from_m1=m1.e_from_marker,
            covariance=covariance,
            newest_ns=used_ns,
            elbow=elbow,
        )

    def elbow_angles(self, e_from_arm: Array, joint_positions: Array, covariance: Array | None) -> ElbowAngles | None:
        """Return the elbow's angles, as of `ElbowGeometry.angles`; None if the station file has no `[elbow]`."""
        return None if self._elbow is None else self._elbow.angles(e_from_arm, joint_positions, covariance)

    def _covariance_of_arm(self, J_0: Array, J_1: Array, m0: Array, m1: Array) -> Array | None:
        """Return the (3, 3) covariance of the arm's rotation in E, from the Jacobians (E axes) of that in the GH frame."""
        if self._elbow is None:
            return None
        J_0 = J_0 + np.eye(3, 6)  # without the error of the frame that the arm is told in
        return np.asarray(J_0 @ m0 @ J_0.T + J_1 @ m1 @ J_1.T)

    def _weakness(self, m0: PoseSample, m1: PoseSample, gh_from_arm: Array, covariance: Array | None) -> Reason:
        """Return the gravest reason why angles that are there are not plainly valid."""
        if covariance is not None and max(euler_sigma_rad(gh_from_arm, covariance)) > self.sigma_limit_rad:
            return Reason.UNCERTAIN
        if m0.color_only or m1.color_only:
            return Reason.COLOR_ONLY
        if m0.fewer_disks or m1.fewer_disks:
            return Reason.FEWER_DISKS
        if m0.bridged or m1.bridged:
            return Reason.BRIDGED
        return Reason.NONE


def lost(t_ns: int, reason: Reason, newest_ns: Mapping[str, int]) -> GhEstimate:
    """Return an estimate without angles, and why."""
    return GhEstimate(t_ns, Status.LOST, reason, None, None, None, None, None, dict(newest_ns))
