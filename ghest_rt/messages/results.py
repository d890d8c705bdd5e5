"""What passes between vision, estimation, service and studies. Frames as in docs/frames.md; `a_from_b` throughout."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class MarkerStatus(StrEnum):
    """What became of a marker in one frame; all but `OK` and `COLOR_ONLY` come without a pose."""

    OK = "ok"
    COLOR_ONLY = "color_only"  # a pose, from colour alone: depth was missing or unusable
    NOT_FOUND = "not_found"  # no disk seen anywhere
    TOO_FEW_DISKS = "too_few_disks"  # hidden, out of view, or cut by the border
    AMBIGUOUS = "ambiguous"  # several poses explain the image and nothing chooses between them
    BAD_FIT = "bad_fit"  # what was seen does not match the marker's geometry
    OUT_OF_RANGE = "out_of_range"  # a pose nearer or farther than the sensor can see


@dataclass(frozen=True, slots=True, eq=False)
class MarkerObservation:
    """One marker in one frame.

    Attributes:
        camera: Camera name.
        marker: Marker name.
        seq: Frame number.
        t_capture_ns: Host time of the frame's mid-exposure.
        t_arrival_ns: Host time of the frame's delivery.
        status: Whether there is a pose, or why not.
        camera_from_marker: (4, 4) marker pose in the (colour) camera frame, metres; None without a pose.
        covariance: (6, 6) of (rotation error rad, translation error m), both in camera axes: true rotation =
            exp(rotation error) R, true position = p + translation error; None where the method computes none.
        disks_used: How many disks the pose rests on.
        depth_used: Whether depth took part.
    """

    camera: str
    marker: str
    seq: int
    t_capture_ns: int
    t_arrival_ns: int
    status: MarkerStatus
    camera_from_marker: Array | None = None
    covariance: Array | None = None
    disks_used: int = 0
    depth_used: bool = False


class Status(StrEnum):
    """How far a published sample may be trusted."""

    VALID = "valid"
    DEGRADED = "degraded"  # angles present, but with less information than normal: see the reason
    LOST = "lost"  # no angles


class Reason(StrEnum):
    """Why a sample is not plainly valid; `NONE` for a valid one."""

    NONE = "none"
    STARTING = "starting"  # not every input has arrived yet
    R0_NO_FRAMES = "r0_no_frames"
    R1_NO_FRAMES = "r1_no_frames"
    M0_NOT_SEEN = "m0_not_seen"
    M1_NOT_SEEN = "m1_not_seen"
    ENCODERS_SILENT = "encoders_silent"
    ENCODERS_IMPLAUSIBLE = "encoders_implausible"
    COLOR_ONLY = "color_only"
    FEWER_DISKS = "fewer_disks"
    UNCERTAIN = "uncertain"  # sigma above the station's limit
    BRIDGED = "bridged"  # interpolated over a gap longer than normal
    MARKER_DRIFT = "marker_drift"  # a marker has moved on its bone; compensated as far as that can be seen
    END_OF_RECORDING = "end_of_recording"


@dataclass(frozen=True, slots=True, eq=False)
class MarkerDrift:
    """How far a marker has moved on its bone since the calibration.

    Attributes:
        flagged: Whether it has, beyond what calibration leaves open.
        probability: Of that.
        slide_m: (3,) displacement, axes of the marker as calibrated.
        slide_sigma_m: (3,) its standard deviations: large where the data say nothing.
        turn_rad: (3,) rotation vector, same axes.
        turn_sigma_rad: (3,) its standard deviations.
    """

    flagged: bool
    probability: float
    slide_m: Array
    slide_sigma_m: Array
    turn_rad: Array
    turn_sigma_rad: Array


@dataclass(frozen=True, slots=True, eq=False)
class DriftReport:
    """The drift of both markers."""

    m0: MarkerDrift
    m1: MarkerDrift


@dataclass(frozen=True, slots=True)
class ElbowAngles:
    """The elbow at one instant, docs/angles.md; angles as if the arm were a right one.

    Attributes:
        flexion_rad: Angle from the stretched arm to the forearm module's axis, about the arm's x axis.
        carrying_rad: Of that axis out of the plane of flexion, away from the body.
        pronation_rad: Of the hand module against the forearm module; None if no encoder measures it.
        sigma_rad: Standard deviations of flexion and carrying angle; None where the method computes none.
    """

    flexion_rad: float
    carrying_rad: float
    pronation_rad: float | None
    sigma_rad: tuple[float, float] | None


@dataclass(frozen=True, slots=True, eq=False)
class GhEstimate:
    """The glenohumeral joint at one instant.

    Attributes:
        t_sample_ns: Host time the estimate holds for.
        status: How far to trust it.
        reason: Why it is not plainly valid.
        gh_from_arm: (3, 3) rotation of the arm in the GH frame, what the angles decompose; None when lost.
        m0_from_arm: (4, 4) arm pose in the m0 frame, eq. (10); None when lost.
        e_from_m0: (4, 4) marker m0 in the exoskeleton base frame, eq. (7); None when lost.
        e_from_m1: (4, 4) marker m1 in the exoskeleton base frame, eq. (7); None when lost.
        covariance: (3, 3) of the rotation error (rad, GH axes): true rotation = exp(error) gh_from_arm; None if unknown.
        newest_ns: Capture time of the newest sample used of each input ("r0", "r1", "encoders"); absent if never seen.
        drift: Whether markers have moved on their bones; None where the method does not look.
        elbow: The elbow; None when lost, or if the station file has no `[elbow]`.
    """

    t_sample_ns: int
    status: Status
    reason: Reason
    gh_from_arm: Array | None
    m0_from_arm: Array | None
    e_from_m0: Array | None
    e_from_m1: Array | None
    covariance: Array | None
    newest_ns: dict[str, int]
    drift: DriftReport | None = None
    elbow: ElbowAngles | None = None


@dataclass(frozen=True, slots=True, eq=False)
class TruthSample:
    """Ground truth of a simulation at one instant.

    Attributes:
        t_ns: Recording time, the same axis as every `t_capture_ns`.
        gh_from_arm: (3, 3) rotation of the upper arm in the GH frame of the scapula.
        m0_from_arm: (4, 4) upper arm frame in the *nominal* m0 frame (where calibration says the marker is).
        e_from_m0: (4, 4) marker m0 as it really is, in the exoskeleton base frame.
        e_from_m1: (4, 4) marker m1 as it really is, in the exoskeleton base frame.
        e_from_arm: (4, 4) upper arm frame in the exoskeleton base frame.
        joints_rad: True exoskeleton joint positions by name (metres for prismatic joints).
        elbow_rad: The patient's true elbow flexion and pronation; None in recordings that lack them.
    """

    t_ns: int
    gh_from_arm: Array
    m0_from_arm: Array
    e_from_m0: Array
    e_from_m1: Array
    e_from_arm: Array
    joints_rad: dict[str, float]
    elbow_rad: tuple[float, float] | None = None
