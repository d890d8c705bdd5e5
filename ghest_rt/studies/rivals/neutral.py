"""The calibration that every rival gets: the patient in the neutral posture, the exoskeleton's joints read."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, rot_x
from ghest_rt.kinematics.forward import ForwardKinematics
from ghest_rt.simulation.anatomy import Anatomy
from ghest_rt.simulation.posture import Posture
from ghest_rt.simulation.sensors import SensorSet
from ghest_rt.simulation.world import World

ELBOW_RAD = np.pi / 2
"""Elbow flexion in the neutral posture."""

LINKS = ("l5", "l8", "l10")
"""The exoskeleton's elbow pivot, forearm module and hand grip: what touches the patient."""

_STILL_S = 0.2
_POSTURE = Posture(
    thorax=np.eye(3),
    thorax_shift_m=np.zeros(3),
    clavicle_rad=(0.0, 0.0),
    scapula=np.eye(3),
    gh=np.eye(3),
    elbow_rad=(ELBOW_RAD, 0.0),
    wrist_rad=(0.0, 0.0),
)


@dataclass(frozen=True, slots=True)
class NeutralMotion:
    """The patient holds the neutral posture: arm stretched forward and level, elbow bent inwards by 90 degrees."""

    duration_s: float = _STILL_S

    @property
    def name(self) -> str:
        """What it is called."""
        return "neutral"

    def at(self, t_s: float) -> Posture:
        """Return the posture."""
        return _POSTURE


@dataclass(frozen=True)
class NeutralCalibration:
    """What is known of patient and exoskeleton once the patient has held the neutral posture.

    Lengths and the GH centre are exact, as are those that the markers' methods have by calibration: nobody is handicapped.
    Only a right arm is provided for: every study is made with one.

    Attributes:
        station: The station file, adjusted to the patient.
        body: The patient's dimensions.
        joints: (n,) encoder readings in the neutral posture, rad, in the order of `encoders.joints`.
    """

    station: LoadedStation
    body: Anatomy
    joints: Array

    def __post_init__(self) -> None:
        if self.station.config.station.arm != "right":
            raise BadInputError(f"{self.station.source}: the rivals are made for a right arm; use a station file with one")

    @cached_property
    def kinematics(self) -> ForwardKinematics:
        """The exoskeleton's forward kinematics to `LINKS`."""
        config = self.station.config
        return ForwardKinematics(
            self.station.urdf_text,
            self.station.source,
            base_link=config.exoskeleton.base_link,
            links=LINKS,
            settings_m=config.exoskeleton.settings_m,
            measured_joints=config.encoders.joints,
        )

    def named(self, joints: Array) -> dict[str, float]:
        """Return (n,) joint positions by name, rad."""
        return dict(zip(self.station.config.encoders.joints, joints.tolist(), strict=True))

    @property
    def gh_in_e_m(self) -> Array:
        """(3,) the GH centre in E in this posture."""
        return self.body.gh_in_e_m

    @property
    def mouth_in_e_m(self) -> Array:
        """(3,) the mouth in E: 0.2 m above the sternoclavicular joint, 0.06 m before it (height 1.75 m)."""
        b = self.body
        return b.gh_in_e_m + b.gh_from_ac_m + b.ac_from_sc_m + b.scale * np.array([0.20, 0.0, -0.06])

    @property
    def e_from_hand(self) -> Array:
        """(4, 4) the hand's frame in E in this posture; its origin is the wrist."""
        wrist_m = self.gh_in_e_m + np.array([0.0, self.body.forearm_m, -self.body.upper_arm_m])
        return transform(rot_x(ELBOW_RAD), wrist_m)


def calibrate(station: LoadedStation, body: Anatomy, sensors: SensorSet, seed: int) -> NeutralCalibration:
    """Let the simulated patient hold the neutral posture and read the encoders.

    Raises:
        BadInputError: The station file has a left arm, or cannot be simulated.
        GhestError: The exoskeleton cannot reach the posture.
    """
    world = World(station, body, NeutralMotion(), sensors, seed=seed)
    rows = [sample.angles_rad for k in range(world.encoder_count) if (sample := world.encoder_sample(k)) is not None]
    return NeutralCalibration(station, body, np.mean(rows, axis=0))
