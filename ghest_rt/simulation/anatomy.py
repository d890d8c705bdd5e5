"""Dimensions of the patient's upper body, scaled by height, in the axes of E and for the right arm.

Segment lengths after Drillis and Contini (1966): upper arm 0.186 H, forearm 0.146 H, hand 0.108 H. The rest is drawn to
proportion.
"""

from dataclasses import dataclass

import numpy as np

from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import Array

MIRROR = np.diag([1.0, -1.0, 1.0])
"""Reflection in the x-z plane of E: turns a right arm into a left one."""

MIN_HEIGHT_M = 1.4
MAX_HEIGHT_M = 2.1
_REFERENCE_HEIGHT_M = 1.75


@dataclass(frozen=True, slots=True, eq=False)
class Anatomy:
    """The patient in the neutral posture, right arm, E axes; mirror for the left.

    The seat is adjusted so that the GH centre is always at the same place of the exoskeleton. It is deliberately not on the
    exoskeleton's axes: real people's never is, and that misalignment is why joint angles of the exoskeleton are not those of
    the arm.

    Attributes:
        height_m: Body height.
        scale: Height relative to 1.75 m.
        gh_in_e_m: (3,) GH centre.
        gh_from_ac_m: (3,) acromioclavicular joint seen from the GH centre.
        ac_from_sc_m: (3,) sternoclavicular joint seen from the acromioclavicular joint.
        upper_arm_m: GH centre to elbow centre.
        forearm_m: Elbow centre to wrist.
        hand_m: Wrist to finger tips.
    """

    height_m: float
    scale: float
    gh_in_e_m: Array
    gh_from_ac_m: Array
    ac_from_sc_m: Array
    upper_arm_m: float
    forearm_m: float
    hand_m: float

    def exoskeleton_settings_m(self) -> dict[str, float]:
        """Return the prismatic settings a therapist would make, to the 5 mm marks of the scales.

        The upper-arm link is set 45 mm longer than the arm, to reach where the arm does; the forearm module follows
        half of the difference between forearms, since its splint is long.
        """
        mark = 0.005
        upper = round((self.upper_arm_m + 0.045 - 0.225) / mark) * mark
        fore = round(0.5 * (self.forearm_m - 0.146 * _REFERENCE_HEIGHT_M) / mark) * mark
        return {"j3_length": round(upper, 6), "j5": 0.0, "j7": round(fore, 6) + 0.0}


def anatomy(height_m: float) -> Anatomy:
    """Return the dimensions of a patient of that height.

    Raises:
        BadInputError: The height is outside what the exoskeleton can be adjusted to.
    """
    if not MIN_HEIGHT_M <= height_m <= MAX_HEIGHT_M:
        raise BadInputError(f"height {height_m} m: give a height from {MIN_HEIGHT_M} to {MAX_HEIGHT_M} m")
    scale = height_m / _REFERENCE_HEIGHT_M
    return Anatomy(
        height_m=height_m,
        scale=scale,
        gh_in_e_m=np.array([0.040, 0.025, -0.150]),
        gh_from_ac_m=scale * np.array([0.042, 0.015, 0.005]),
        ac_from_sc_m=scale * np.array([-0.040, 0.140, -0.045]),
        upper_arm_m=0.186 * height_m,
        forearm_m=0.146 * height_m,
        hand_m=0.108 * height_m,
    )
