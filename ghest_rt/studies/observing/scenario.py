"""What is simulated and estimated in one run of a study."""

import hashlib
from pathlib import Path
from typing import Literal

from pydantic import Field

from ghest_rt.config.strict import Strict
from ghest_rt.errors import BadInputError
from ghest_rt.simulation.building import build_world, motion_of
from ghest_rt.simulation.disturbances import SoftTissueName, parse_shift, parse_turn
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.simulation.posture import Motion
from ghest_rt.simulation.texture import MarkerTexture
from ghest_rt.simulation.therapy import find_movement
from ghest_rt.simulation.world import World
from ghest_rt.vision.station import Method

Vector3 = tuple[float, float, float]
SensorName = Literal["paper", "sr300"]

HEIGHT_M = 1.75
"""The patient's, in every study."""


class MotionFile(Strict):
    """An OpenSim motion file, known by its content."""

    path: str
    sha256: str


class MountError(Strict):
    """A camera that does not stand on its link as the calibration says: calibrated link_from_camera = true * exp(error)."""

    rotation_rad: Vector3 = Field(default=(0.0, 0.0, 0.0), description="Rotation vector, camera axes")
    translation_m: Vector3 = Field(default=(0.0, 0.0, 0.0), description="Camera axes")


class Scenario(Strict):
    """One simulated session and what the estimator is told wrongly about it.

    Marker moves and soft tissue happen in the scene; mount errors and encoder biases are given to the estimator alone.
    """

    movement: str | None = Field(default=None, description="A movement of Table 2")
    motion: MotionFile | None = Field(default=None, description="A recorded movement instead")
    sensor: SensorName = "paper"
    seed: int = 1
    duration_s: float | None = None
    shifts: tuple[str, ...] = Field(default=(), description="Marker shifts as on the command line, m1:x:0.02")
    turns: tuple[str, ...] = Field(default=(), description="Marker turns as on the command line, m0:z:5")
    soft_tissue: SoftTissueName = "none"
    mount_errors: dict[str, MountError] = Field(default={}, description="By camera")
    encoder_bias_rad: dict[str, float] = Field(default={}, description="Added to what the encoders say, by joint")
    methods: tuple[Method, ...] = ("paper", "refined", "fused")

    @property
    def name(self) -> str:
        """Name of the movement."""
        return Path(self.motion.path).stem if self.motion is not None else find_movement(self.movement or "").name

    @property
    def moved_markers(self) -> frozenset[str]:
        """The markers whose images differ from those of the undisturbed session."""
        if self.soft_tissue != "none":
            return frozenset(("m0", "m1"))
        return frozenset(text.partition(":")[0] for text in (*self.shifts, *self.turns))

    def as_seen(self) -> "Scenario":
        """Return the session as the cameras meet it: nothing told wrongly to the estimator, that is."""
        return self.model_copy(update={"mount_errors": {}, "encoder_bias_rad": {}})

    def undisturbed(self) -> "Scenario":
        """Return the session with every marker where the calibration says, and nothing told wrongly."""
        return self.as_seen().model_copy(update={"shifts": (), "turns": (), "soft_tissue": "none"})

    def performed(self) -> Motion:
        """Return what the patient does, the whole of it.

        Raises:
            BadInputError: The movement is unknown, or the motion file cannot be used or is not what it was.
        """
        self._check_file()
        return motion_of(self.movement, self._motion_path(), self.seed)

    def world(self, marker: MarkerTexture = "disks") -> World:
        """Set up the simulated clinic.

        Args:
            marker: What is printed on the marker plates.

        Raises:
            BadInputError: A part of the scenario cannot be used, or the motion file is not what it was.
        """
        self._check_file()
        return build_world(
            SimulateOptions(
                out=Path(),
                movement=self.movement,
                motion=self._motion_path(),
                sensor=self.sensor,
                seed=self.seed,
                height_m=HEIGHT_M,
                duration_s=self.duration_s,
                marker_moves=(*map(parse_shift, self.shifts), *map(parse_turn, self.turns)),
                soft_tissue=self.soft_tissue,
                marker=marker,
            )
        )

    def _motion_path(self) -> Path | None:
        return None if self.motion is None else Path(self.motion.path)

    def _check_file(self) -> None:
        if self.motion is not None and motion_file(Path(self.motion.path)) != self.motion:
            raise BadInputError(f"{self.motion.path}: the file has changed since the study began; start the study again")


def motion_file(path: Path) -> MotionFile:
    """Return a motion file with its content's hash.

    Raises:
        BadInputError: It cannot be read.
    """
    try:
        return MotionFile(path=str(path.resolve()), sha256=hashlib.sha256(path.read_bytes()).hexdigest())
    except OSError as error:
        raise BadInputError(f"{path}: cannot be read: {error.strerror or error}; name a motion file (.mot)") from error
