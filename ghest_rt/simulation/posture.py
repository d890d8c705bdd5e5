"""Posture of the patient at one instant, and motions: postures over time. Always told for the right arm, in E axes."""

from dataclasses import dataclass
from typing import Protocol

from ghest_rt.geometry.so3 import Array


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
    """Joint positions of the patient's upper body; all zero is the neutral posture with the elbow stretched.

    Attributes:
        thorax: (3, 3) rotation of the thorax against its neutral attitude, E axes.
        thorax_shift_m: (3,) displacement of the sternoclavicular joint, E axes.
        clavicle_rad: Protraction (forwards), elevation.
        scapula: (3, 3) acromioclavicular rotation: scapula in the clavicle's frame; identity where it moves with the clavicle.
        gh: (3, 3) rotation of the upper arm in the GH frame of the scapula: the truth that everything is judged by.
        elbow_rad: Flexion (0 is stretched, 90 degrees points the forearm inwards), pronation.
        wrist_rad: Flexion, deviation.
    """

    thorax: Array
    thorax_shift_m: Array
    clavicle_rad: tuple[float, float]
    scapula: Array
    gh: Array
    elbow_rad: tuple[float, float]
    wrist_rad: tuple[float, float]


class Motion(Protocol):
    """A movement of the patient, smooth in time."""

    @property
    def name(self) -> str:
        """What it is called in recordings."""
        ...

    @property
    def duration_s(self) -> float:
        """How long it lasts; `at` answers 0.2 s before and after, too."""
        ...

    def at(self, t_s: float) -> Posture:
        """Return the posture at a time of the movement, seconds."""
        ...
