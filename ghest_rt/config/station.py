"""Schema of the station file (TOML). Unknown keys, wrong units and non-rigid matrices are refused."""

import itertools
from collections.abc import Callable
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from ghest_rt.config.camera_devices import OakBackend, RealsenseBackend, RealsenseBagBackend
from ghest_rt.config.devices import CameraBackend, EncoderBackend
from ghest_rt.config.metrics import Metrics
from ghest_rt.config.strict import NAME_FORM, Strict
from ghest_rt.geometry.se3 import rigidity_problem
from ghest_rt.geometry.so3 import Array

STATION_FORMAT = 1

# Out to this distance of chromaticities (shares of red, green and blue) a spot is taken for a disk of the nominal colour: two
# nominal colours that are no farther apart than that pass for each other.
COLOR_REACH = 0.24

# No link of an exoskeleton for a limb is longer: farther from its link no elbow can be.
_LONGEST_LINK_M = 1.0
# A camera of the base link may stand on a tripod or hang from the ceiling.
_FARTHEST_CAMERA_M = 5.0
# Farther from its joint no marker is worn: the longest upper arms and shanks are under 0.5 m.
_LONGEST_LIMB_M = 0.5

Name = Annotated[str, Field(pattern=NAME_FORM)]
Row = tuple[float, float, float, float]
Byte = Annotated[int, Field(ge=0, le=255)]
Rgb = tuple[Byte, Byte, Byte]


def _rigid(rows: tuple[Row, Row, Row, Row]) -> tuple[Row, Row, Row, Row]:
    problem = rigidity_problem(np.array(rows))
    if problem:
        raise ValueError(f"the matrix {problem}; translations are in metres, rotations are unit columns")
    return rows


def _within(limit_m: float) -> Callable[[tuple[Row, Row, Row, Row]], tuple[Row, Row, Row, Row]]:
    def check(rows: tuple[Row, Row, Row, Row]) -> tuple[Row, Row, Row, Row]:
        length_m = float(np.linalg.norm([row[3] for row in rows[:3]]))
        if length_m > limit_m:
            raise ValueError(
                f"the translation is {length_m:g} m long, more than {limit_m:g} m; "
                "lengths are in metres: are these millimetres?"
            )
        return rows

    return check


RigidMatrix = Annotated[tuple[Row, Row, Row, Row], AfterValidator(_rigid)]
CameraMatrix = Annotated[RigidMatrix, AfterValidator(_within(_FARTHEST_CAMERA_M))]
LimbMatrix = Annotated[RigidMatrix, AfterValidator(_within(_LONGEST_LIMB_M))]


class Station(Strict):
    """Who this is."""

    id: Name = Field(description="Key segment under which this station publishes: ghest/<id>/…")
    arm: Literal["right", "left"] = Field(description="The patient's arm in the exoskeleton; sets the clinical signs")


Sign = Literal[-1, 1]


class Joint(Strict):
    """Which joint is measured: marker m0 sits on its proximal body, m1 on its distal one; docs/other-limbs.md."""

    name: Name = Field(default="gh", description="Told in every sample as `joint`")
    flexion_sign: Sign = Field(default=-1, description="Of the y-x-z angle a in `flexion`")
    abduction_sign: Sign = Field(default=-1, description="Of b in `abduction`, right side; the other way round on the left")
    rotation_sign: Sign = Field(default=1, description="Of g in `rotation`, right side; the other way round on the left")


class Exoskeleton(Strict):
    """The kinematic model and the settings made for this patient."""

    urdf: str = Field(description="URDF file, relative to the station file")
    base_link: str = "l0"
    settings_m: dict[str, float] = Field(default={}, description="Prismatic joints set per patient, metres")


def chromaticity(rgb: Rgb) -> Array:
    """Return the (3,) shares of red, green and blue in a colour, which do not depend on its brightness."""
    return np.array(rgb) / max(sum(rgb), 1)


class Marker(Strict):
    """A square plate with one coloured disk per corner, eq. (5): p0 (+a,-a), p1 (-a,-a), p2 (+a,+a), p3 (-a,+a)."""

    half_spacing_m: float = Field(gt=0.002, lt=0.2, description="a: half the distance between neighbouring disk centres")
    disk_radius_m: float = Field(gt=0.001, lt=0.1)
    plate_m: float = Field(gt=0.004, lt=0.5, description="Side of the square white plate")
    disk_rgb: tuple[Rgb, Rgb, Rgb, Rgb] = Field(description="Nominal colours of p0..p3 under neutral light")

    @model_validator(mode="after")
    def _fits(self) -> "Marker":
        if self.disk_radius_m >= self.half_spacing_m:
            raise ValueError("disk_radius_m must be less than half_spacing_m: the disks would touch")
        if 2 * (self.half_spacing_m + self.disk_radius_m) > self.plate_m:
            raise ValueError("plate_m is too small for the disks; measure plate, disks and spacing again")
        for one, other in itertools.combinations(range(4), 2):
            apart = float(np.linalg.norm(chromaticity(self.disk_rgb[one]) - chromaticity(self.disk_rgb[other])))
            if apart <= COLOR_REACH:
                raise ValueError(
                    f"disk_rgb: p{one} {self.disk_rgb[one]} and p{other} {self.disk_rgb[other]} are too much alike to be told "
                    f"apart: {apart:.2f} between their chromaticities, {COLOR_REACH:g} is too little, however bright they are; "
                    "take disks of four different colours, like those of the shipped stations"
                )
        return self


class Camera(Strict):
    """One RGB-D camera on one link, looking at one marker."""

    link: str = Field(description="URDF link the camera is fixed to")
    marker: Name
    depth: bool = Field(default=True, description="false: work from colour alone; the device needs no depth stream")
    device: CameraBackend = Field(discriminator="backend")


class Elbow(Strict):
    """Where the forearm is on the exoskeleton, for the elbow's angles."""

    link: str = Field(description="URDF link that the forearm is strapped to")
    axis: tuple[float, float, float] = Field(description="Direction from elbow to wrist in that link's frame")
    axis_sigma_deg: float = Field(default=3.0, gt=0, le=45, description="How well the forearm follows that axis")
    pronation_joint: str | None = Field(default=None, description="One of encoders.joints: hand against forearm module")

    @model_validator(mode="after")
    def _directed(self) -> "Elbow":
        if not 0.99 <= float(np.linalg.norm(self.axis)) <= 1.01:
            raise ValueError("axis must be of length 1")
        return self


class Encoders(Strict):
    """The exoskeleton's encoder link."""

    joints: tuple[str, ...] = Field(min_length=1, description="URDF joints measured, in the order they are sent")
    device: EncoderBackend = Field(discriminator="backend")

    @model_validator(mode="after")
    def _once_each(self) -> "Encoders":
        twice = sorted({joint for joint in self.joints if self.joints.count(joint) > 1})
        if twice:
            raise ValueError(
                f"joints names {', '.join(twice)} twice; name each joint once, in the order in which they are sent"
            )
        return self


class CalibrationReference(Strict):
    """What a calibration session sees besides the markers: neutral posture, elbow bent, every marker where it belongs.

    Method fused holds later sessions against it; docs/fused-estimator.md, section 6. The sigmas are standard deviations, per
    axis, of how well another session repeats what was seen.
    """

    elbow_in_link_m: tuple[float, float, float] | None = Field(
        default=None, description="Elbow's centre in the frame of the link that carries camera r1"
    )
    elbow_sigma_m: float = Field(default=0.005, gt=0, le=0.1)
    forearm_twist_deg: float | None = Field(
        default=None, ge=-90, le=90, description="Forearm ([elbow].axis) out of the elbow frame's y-z plane, about its y axis"
    )
    forearm_sigma_deg: float = Field(default=2.0, gt=0, le=45)

    @model_validator(mode="after")
    def _near(self) -> "CalibrationReference":
        if self.elbow_in_link_m is not None and np.linalg.norm(self.elbow_in_link_m) > _LONGEST_LINK_M:
            raise ValueError(f"elbow_in_link_m is more than {_LONGEST_LINK_M:g} m from its link; lengths are in metres")
        return self


class Calibration(Strict):
    """Rigid transforms found by calibration, (4, 4) row by row, metres."""

    id: Name
    link_from_camera: dict[str, CameraMatrix] = Field(description="Camera (OpenCV axes) in its link's frame, eq. (6)")
    m0_from_gh: LimbMatrix = Field(description="GH joint frame in the m0 frame, eq. (8)")
    m1_from_elw: LimbMatrix = Field(description="Elbow frame in the m1 frame, eq. (9)")
    arm_length_m: float | None = Field(
        default=None, gt=0.1, lt=0.6, description="From elbow to GH centre; lets method fused see m1 slide along the arm"
    )
    reference: CalibrationReference = CalibrationReference()

    def link_from_camera_array(self, camera: str) -> Array:
        """Return T_r^l of eq. (6)."""
        return np.array(self.link_from_camera[camera])


class Estimator(Strict):
    """How angles are computed."""

    method: Literal["paper", "refined", "photometric", "fused"] = "fused"
    encoder_pairing: Literal["interpolate", "nearest"] = "interpolate"
    lag_ms: float = Field(
        default=45.0,
        ge=0.0,
        le=500.0,
        description="A sample is published this long after the instant it holds for; method fused forecasts, and has none",
    )
    max_gap_ms: float = Field(default=100.0, gt=0, le=1000, description="Longest gap in an input that is interpolated over")
    sigma_limit_deg: float = Field(default=5.0, gt=0, le=180, description="Above this the sample is `degraded`")


class Publisher(Strict):
    """Zenoh. Out of the box nothing leaves this machine."""

    enabled: bool = True
    listen: tuple[str, ...] = ("tcp/127.0.0.1:7447",)
    connect: tuple[str, ...] = ()
    identity: str | None = Field(
        default=None,
        description="Folder made by `ghest-rt certs issue`, relative to the station file; needed beyond this machine",
    )


class Recorder(Strict):
    """What holds for every recording of this station."""

    encrypt_to: tuple[str, ...] = Field(
        default=(), max_length=20, description="Public keys (age1…) that recordings are sealed for: `ghest-rt recording-key`"
    )


class StationConfig(Strict):
    """The whole station file."""

    format: Literal[1]
    station: Station
    rate_hz: float = Field(default=66.6, ge=1.0, le=500.0, description="Publishing rate")
    joint: Joint = Joint()
    exoskeleton: Exoskeleton
    markers: dict[Name, Marker]
    cameras: dict[Name, Camera]
    encoders: Encoders
    calibration: Calibration
    elbow: Elbow | None = None
    estimator: Estimator = Estimator()
    publisher: Publisher = Publisher()
    recorder: Recorder = Recorder()
    metrics: Metrics = Metrics()

    @model_validator(mode="after")
    def _complete(self) -> "StationConfig":
        groups = (
            ("markers", self.markers, {"m0", "m1"}),
            ("cameras", self.cameras, {"r0", "r1"}),
            ("calibration.link_from_camera", self.calibration.link_from_camera, {"r0", "r1"}),
        )
        for key, group, wanted in groups:
            missing = sorted(wanted - set(group))
            if missing:
                raise ValueError(f"[{key}] lacks {', '.join(missing)}")
        for camera, marker in (("r0", "m0"), ("r1", "m1")):
            if self.cameras[camera].marker != marker:
                raise ValueError(f"cameras.{camera}.marker must be {marker}: r0 sees the acromion, r1 the upper arm")
        first, second = (_device_id(self.cameras[camera].device) for camera in ("r0", "r1"))
        if first is not None and first == second:
            raise ValueError(
                f"cameras.r0 and cameras.r1 are the same device, {first}; "
                "give each its own (ghest-rt doctor prints what is connected)"
            )
        pronation = self.elbow.pronation_joint if self.elbow is not None else None
        if pronation is not None and pronation not in self.encoders.joints:
            raise ValueError(f"elbow.pronation_joint {pronation} is not one of encoders.joints")
        return self


def _device_id(device: CameraBackend) -> str | None:
    """Return what tells a camera from another of its kind, None for those that are made for each camera anew."""
    match device:
        case RealsenseBackend():
            return f"serial {device.serial}"
        case OakBackend():
            return f"mxid {device.mxid}"
        case RealsenseBagBackend():
            return f"path {device.path}"
        case _:
            return None
