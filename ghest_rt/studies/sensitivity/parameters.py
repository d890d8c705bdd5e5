"""What is perturbed, and how a session is changed by it."""

import math
from dataclasses import dataclass
from typing import Literal

from ghest_rt.studies.observing.scenario import MountError, Scenario
from ghest_rt.studies.paper_values import PARAMETERS

Group = Literal["shift", "turn", "both", "mount_shift", "mount_turn", "encoder"]

AXES = ("x", "y", "z")

ENCODERS = ("j0", "j1", "j2", "j4", "j6")
"""The encoders of the shipped stations that say where camera r1 is."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One perturbed parameter.

    Attributes:
        group: "shift": q1-q6 of Table 3, a marker displaced along an axis of the GH (m0) or elbow frame (m1), really moved in
            the scene; "turn": a marker turned about its own centre and axis, in the scene; "both": both markers shifted along
            the same axis of their frames; "mount_shift", "mount_turn": a camera's calibrated place on its link wrong along or
            about an axis of the camera; "encoder": an encoder's bias.
        what: The marker, camera or joint; "m0+m1" for both.
        axis: "x", "y" or "z"; "" for an encoder.
    """

    group: Group
    what: str
    axis: str

    @property
    def unit(self) -> Literal["m", "deg"]:
        """Unit of its amounts."""
        return "m" if self.group in {"shift", "both", "mount_shift"} else "deg"

    @property
    def name(self) -> str:
        """The paper's name of q1 to q6, otherwise a descriptive one."""
        if self.group == "shift":
            return next(name for name, place in PARAMETERS.items() if place == (self.what, self.axis))
        return " ".join(part for part in (self.group, self.what, self.axis) if part)

    def applied(self, base: Scenario, amount: float) -> Scenario:
        """Return the session perturbed by an amount (m or deg)."""
        return base.model_copy(update=self._change(amount)) if amount else base

    def _change(self, amount: float) -> dict[str, object]:
        match self.group:
            case "shift":
                return {"shifts": (f"{self.what}:{self.axis}:{amount:.6g}",)}
            case "both":
                return {"shifts": tuple(f"{marker}:{self.axis}:{amount:.6g}" for marker in ("m0", "m1"))}
            case "turn":
                return {"turns": (f"{self.what}:{self.axis}:{amount:.6g}",)}
            case "mount_shift":
                return {"mount_errors": {self.what: MountError(translation_m=self._vector(amount))}}
            case "mount_turn":
                return {"mount_errors": {self.what: MountError(rotation_rad=self._vector(math.radians(amount)))}}
            case "encoder":
                return {"encoder_bias_rad": {self.what: math.radians(amount)}}

    def _vector(self, amount: float) -> tuple[float, float, float]:
        x, y, z = (amount if axis == self.axis else 0.0 for axis in AXES)
        return x, y, z


def paper_parameters() -> list[Parameter]:
    """Return q1 to q6 of Table 3."""
    return [Parameter("shift", marker, axis) for marker, axis in PARAMETERS.values()]


def further_parameters() -> list[Parameter]:
    """Return what the paper leaves out."""
    return [
        *(Parameter("turn", marker, axis) for marker in ("m0", "m1") for axis in AXES),
        *(Parameter("both", "m0+m1", axis) for axis in AXES),
        *(Parameter("mount_shift", camera, axis) for camera in ("r0", "r1") for axis in AXES),
        *(Parameter("mount_turn", camera, axis) for camera in ("r0", "r1") for axis in AXES),
        *(Parameter("encoder", joint, "") for joint in ENCODERS),
    ]
