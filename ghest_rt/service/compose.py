"""From an estimate (radians, metres) to the message published (degrees, ages)."""

import math
import secrets
from typing import Literal

import numpy as np

from ghest_rt.config.station import Joint
from ghest_rt.estimation.angles import GH_SIGNS, AngleSigns, Arm, clinical, euler_yxz, signs_of
from ghest_rt.estimation.isb import isb_yxy
from ghest_rt.estimation.swing_twist import swing_twist
from ghest_rt.estimation.uncertainty import euler_sigma_rad
from ghest_rt.geometry.so3 import Array, quat_wxyz_from_matrix
from ghest_rt.messages.published import Clinical, Drift, Elbow, GhAngles, IsbYxy, MarkerDriftState, Singular, SwingTwist
from ghest_rt.messages.results import DriftReport, ElbowAngles, GhEstimate, MarkerDrift

_INPUTS = ("r0", "r1", "encoders")


def sigma_of(gh_from_arm: Array, covariance: Array | None) -> Clinical | None:
    """Return the standard deviations of the clinical angles, degrees; None if the covariance is unknown."""
    if covariance is None:
        return None
    a, b, g = (math.degrees(sigma) for sigma in euler_sigma_rad(gh_from_arm, covariance))
    return Clinical(flexion=a, abduction=b, rotation=g)


def clinical_deg(gh_from_arm: Array, arm: Arm, signs: AngleSigns = GH_SIGNS) -> Clinical:
    """Return the clinical angles, degrees."""
    angles = clinical(euler_yxz(gh_from_arm), arm, signs)
    return Clinical(
        flexion=math.degrees(angles.flexion_rad),
        abduction=math.degrees(angles.abduction_rad),
        rotation=math.degrees(angles.rotation_rad),
    )


def drift_of(report: DriftReport | None) -> Drift | None:
    """Return the markers' drift, millimetres and degrees, rounded for size; None if the method does not look."""
    return None if report is None else Drift(m0=_marker_drift(report.m0), m1=_marker_drift(report.m1))


def _marker_drift(drift: MarkerDrift) -> MarkerDriftState:
    return MarkerDriftState(
        flagged=drift.flagged,
        probability=round(min(max(float(drift.probability), 0.0), 1.0), 4),
        slide_mm=_rounded(drift.slide_m * 1e3),
        slide_sigma_mm=_rounded(drift.slide_sigma_m * 1e3),
        turn_deg=_rounded(np.degrees(drift.turn_rad)),
        turn_sigma_deg=_rounded(np.degrees(drift.turn_sigma_rad)),
    )


def _rounded(values: Array) -> tuple[float, float, float]:
    x, y, z = (round(value, 2) for value in values.tolist())
    return x, y, z


def elbow_of(elbow: ElbowAngles | None) -> tuple[Elbow | None, Elbow | None]:
    """Return the elbow's angles and their standard deviations, degrees; None where there are none."""
    if elbow is None:
        return None, None
    pronation = elbow.pronation_rad
    angles = Elbow(
        flexion=math.degrees(elbow.flexion_rad),
        carrying=math.degrees(elbow.carrying_rad),
        pronation=None if pronation is None else math.degrees(pronation),
    )
    if elbow.sigma_rad is None:
        return angles, None
    flexion, carrying = elbow.sigma_rad
    return angles, Elbow(flexion=math.degrees(flexion), carrying=math.degrees(carrying), pronation=None)


class Numbering:
    """Sequence numbers of the messages of one process, per kind; runs of the service one after the other share it.

    Attributes:
        run_id: Tells subscribers that another process counts anew.
    """

    def __init__(self) -> None:
        self.run_id = secrets.token_hex(4)
        self._next = dict.fromkeys(("angles", "health", "events"), 0)

    def take(self, kind: Literal["angles", "health", "events"]) -> int:
        """Return the next number of a kind of message."""
        seq = self._next[kind]
        self._next[kind] += 1
        return seq


class AnglesComposer:
    """Fills in what every message of a run has in common."""

    def __init__(
        self,
        arm: Arm,
        method: str,
        calibration_id: str,
        unix_offset_ns: int,
        numbering: Numbering,
        *,
        joint: Joint | None = None,
    ) -> None:
        """Prepare the run.

        Args:
            arm: The patient's arm in the exoskeleton.
            method: Name of the estimation method.
            calibration_id: From the station file.
            unix_offset_ns: Unix time minus the service's clock.
            numbering: Where the sequence numbers come from.
            joint: The station file's joint; None for the glenohumeral one.
        """
        self.numbering = numbering
        self._arm: Arm = arm
        self._method = method
        self._calibration_id = calibration_id
        self._unix_offset_ns = unix_offset_ns
        self._joint = joint or Joint()
        self._signs = signs_of(self._joint)
        self._is_gh = self._joint.name == Joint().name

    def unix_ns(self, t_ns: int) -> int:
        """Return Unix time of an instant of the service's clock."""
        return t_ns + self._unix_offset_ns

    def compose(self, estimate: GhEstimate, t_publish_ns: int) -> GhAngles:
        """Return the message for an estimate about to be published at `t_publish_ns`."""
        R, newest_ns = estimate.gh_from_arm, estimate.newest_ns
        common = {
            "run_id": self.numbering.run_id,
            "seq": self.numbering.take("angles"),
            "t_sample_ns": estimate.t_sample_ns,
            "t_publish_ns": t_publish_ns,
            "t_sample_unix_ns": self.unix_ns(estimate.t_sample_ns),
            "status": estimate.status,
            "reason": estimate.reason,
            "age_ms": {name: (t_publish_ns - newest_ns[name]) * 1e-6 if name in newest_ns else None for name in _INPUTS},
            "method": self._method,
            "calibration_id": self._calibration_id,
            "joint": self._joint.name,
        }
        if R is None or estimate.m0_from_arm is None:
            return GhAngles.model_validate(common | _NO_ANGLES)
        elbow, elbow_sigma = elbow_of(estimate.elbow)
        euler = euler_yxz(R)
        angles = {
            "angles_deg": clinical_deg(R, self._arm, self._signs),
            "sigma_deg": sigma_of(R, estimate.covariance),
            "euler_yxz_deg": (math.degrees(euler.a_rad), math.degrees(euler.b_rad), math.degrees(euler.g_rad)),
            "quaternion_wxyz": tuple(quat_wxyz_from_matrix(R).tolist()),
            "arm_position_m": tuple(estimate.m0_from_arm[:3, 3].tolist()),
            "drift": drift_of(estimate.drift),
            "elbow_deg": elbow,
            "elbow_sigma_deg": elbow_sigma,
            **(self._sets_of_gh(R, euler.near_singularity) if self._is_gh else _no_sets_of_gh(euler.near_singularity)),
        }
        return GhAngles.model_validate(common | angles)

    def _sets_of_gh(self, R: Array, near_singularity: bool) -> dict[str, object]:
        """Return the sets of angles that only the glenohumeral joint has, and which sets are near their singularity."""
        isb, swing = isb_yxy(R, self._arm), swing_twist(R, self._arm)
        return {
            "isb_yxy_deg": IsbYxy(
                plane_of_elevation=math.degrees(isb.plane_of_elevation_rad),
                elevation=math.degrees(isb.elevation_rad),
                axial_rotation=math.degrees(isb.axial_rotation_rad),
            ),
            "swing_twist_deg": SwingTwist(
                swing_flexion=math.degrees(swing.swing_flexion_rad),
                swing_abduction=math.degrees(swing.swing_abduction_rad),
                twist=math.degrees(swing.twist_rad),
                tilt=math.degrees(swing.tilt_rad),
                azimuth=math.degrees(swing.azimuth_rad),
            ),
            "singular": Singular(
                euler_yxz=near_singularity,
                isb_yxy=isb.near_singularity,
                swing_twist=swing.near_singularity,
                azimuth=swing.azimuth_near_singularity,
            ),
        }


def _no_sets_of_gh(near_singularity: bool) -> dict[str, object]:
    singular = Singular(euler_yxz=near_singularity, isb_yxy=False, swing_twist=False, azimuth=False)
    return {"isb_yxy_deg": None, "swing_twist_deg": None, "singular": singular}


_NO_ANGLES = dict.fromkeys(
    (
        "angles_deg",
        "sigma_deg",
        "euler_yxz_deg",
        "quaternion_wxyz",
        "isb_yxy_deg",
        "swing_twist_deg",
        "singular",
        "arm_position_m",
    )
)
