"""Where the marker plates really are on their bones at any instant."""

from dataclasses import dataclass

import numpy as np

from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import Array, exp_so3
from ghest_rt.simulation.anatomy import MIRROR
from ghest_rt.simulation.disturbances import MarkerMove, MarkerName
from ghest_rt.simulation.posture import Posture
from ghest_rt.simulation.scene import Scene, arm_from_elw
from ghest_rt.simulation.soft_tissue import SoftTissue


@dataclass(frozen=True, slots=True)
class Attachment:
    """How the markers are attached.

    Attributes:
        scene: The clinic, with movable plates.
        moves: Shifts and turns; several of one marker add up, turns in the order given.
        soft_tissue: None for markers screwed to the bones.
    """

    scene: Scene
    moves: tuple[MarkerMove, ...]
    soft_tissue: SoftTissue | None

    def nominal_from_marker(self, marker: MarkerName, t_s: float, posture: Posture) -> Array:
        """Return the (4, 4) pose of a marker at `t_s` of the movement, seen from where the calibration has it."""
        bone_from_nominal = self.scene.scapula_from_m0 if marker == "m0" else self.scene.humerus_from_m1
        bone_from_axes = np.eye(3) if marker == "m0" else arm_from_elw(self.scene.anatomy.upper_arm_m)[:3, :3]
        shift, turn = np.zeros(3), np.eye(3)
        for move in self.moves:
            if move.marker == marker and move.kind == "shift":
                shift[move.axis] += move.at(t_s)
            elif move.marker == marker:
                turn = turn @ exp_so3(move.at(t_s) * np.eye(3)[move.axis])
        bone_from_marker = transform(np.eye(3), bone_from_axes @ shift) @ bone_from_nominal @ transform(turn, (0.0, 0.0, 0.0))
        return inverse(bone_from_nominal) @ self._bone_from_skin(marker, posture, bone_from_nominal[:3, 3]) @ bone_from_marker

    def _bone_from_skin(self, marker: MarkerName, posture: Posture, place_m: Array) -> Array:
        if self.soft_tissue is None:
            return np.eye(4)
        mirror = transform(np.eye(3) if self.scene.side == "right" else MIRROR, (0.0, 0.0, 0.0))
        place_m = mirror[:3, :3] @ place_m
        if marker == "m0":
            skin = self.soft_tissue.scapula_from_skin(posture, place_m)
        else:
            skin = self.soft_tissue.humerus_from_skin(posture, place_m)
        return mirror @ skin @ mirror
