"""How skin and muscle move the markers against the bones, as functions of the posture.

Magnitudes: a marker on the acromion slides by up to 29 mm over the arm's elevation (acromion clusters against bone pins);
a marker on the upper arm follows only part of the axial rotation, lagging by up to 30 % of it, and a cuff tilts by up to
4 degrees in elevation. See docs/disturbances.md for the sources.
"""

import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, quat_wxyz_from_matrix, rot_x, rot_y, rot_z
from ghest_rt.simulation.posture import Posture

_SLIDE_DIRECTION = np.array([0.5, 0.7, 0.5]) / math.sqrt(0.99)  # up, towards the neck, backwards


@dataclass(frozen=True, slots=True)
class SoftTissue:
    """How soft a patient is. Right arm, axes of the bones (E's in the neutral posture); mirror for the left.

    Attributes:
        acromion_slide_m: Slide of m0 over the scapula with the arm overhead; none with the arm hanging.
        acromion_tilt_rad: Upward tilt of m0's face with the arm overhead.
        axial_lag: Share of the humerus' axial rotation that m1 does not follow.
        cuff_tilt_rad: Tilt of m1 against the humerus with the arm overhead.
    """

    acromion_slide_m: float
    acromion_tilt_rad: float
    axial_lag: float
    cuff_tilt_rad: float

    def scapula_from_skin(self, posture: Posture, m0_in_scapula_m: Array) -> Array:
        """Return the (4, 4) displacement of m0, which tilts about its own place (3,), in the scapula's frame."""
        share = _raised(posture)
        return _about(m0_in_scapula_m, rot_y(self.acromion_tilt_rad * share), self.acromion_slide_m * share * _SLIDE_DIRECTION)

    def humerus_from_skin(self, posture: Posture, m1_in_humerus_m: Array) -> Array:
        """Return the (4, 4) displacement of m1: about the humerus' long axis, and a tilt about its own place (3,)."""
        lag = transform(rot_z(-self.axial_lag * axial_rotation_rad(posture)), (0.0, 0.0, 0.0))
        return lag @ _about(m1_in_humerus_m, rot_x(self.cuff_tilt_rad * _raised(posture)), np.zeros(3))


SOFT_TISSUES = {
    "published": SoftTissue(acromion_slide_m=0.029, acromion_tilt_rad=0.0, axial_lag=0.30, cuff_tilt_rad=0.0),
    "severe": SoftTissue(
        acromion_slide_m=0.0435, acromion_tilt_rad=math.radians(14.0), axial_lag=0.45, cuff_tilt_rad=math.radians(4.0)
    ),
}


def find_soft_tissue(name: str) -> SoftTissue | None:
    """Return a kind of soft tissue by name; None for "none".

    Raises:
        BadInputError: There is none of that name.
    """
    if name == "none":
        return None
    if name not in SOFT_TISSUES:
        raise BadInputError(f"--soft-tissue {name}: unknown: give one of none, {', '.join(SOFT_TISSUES)}")
    return SOFT_TISSUES[name]


def elevation_rad(posture: Posture) -> float:
    """Return the arm's elevation against the thorax: 0 hanging, 90 degrees level, 180 degrees overhead."""
    protraction, elevation = posture.clavicle_rad
    thorax_from_humerus = rot_x(protraction) @ rot_z(elevation) @ posture.scapula @ posture.gh
    # From GH to elbow is -z of the humerus; downwards is -x of the thorax.
    return math.acos(max(-1.0, min(1.0, float(thorax_from_humerus[0, 2]))))


def axial_rotation_rad(posture: Posture) -> float:
    """Return the twist of the humerus about its long axis against the neutral posture (swing-twist), -pi to pi."""
    w, _, _, z = quat_wxyz_from_matrix(posture.gh)  # w >= 0
    return 2.0 * math.atan2(z, w)


def _raised(posture: Posture) -> float:
    """Return 0 with the arm hanging to 1 overhead: sin^2 of half the elevation."""
    return 0.5 * (1.0 - math.cos(elevation_rad(posture)))


def _about(place_m: Array, rotation: Array, shift_m: Array) -> Array:
    return transform(rotation, place_m + shift_m - rotation @ place_m)
