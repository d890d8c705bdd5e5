"""Swing and twist, and the same as tilt and torsion: angles with a single singularity that no shoulder reaches.

gh_from_arm = S Rz(twist), where the swing S turns the arm from straight forward to where it points by the shortest way, about
an axis across the arm. Tilt and torsion (Campbell 1992; Bonev 2002) name the same: Rz(azimuth) Ry(tilt) Rz(torsion - azimuth).
"""

import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.estimation.angles import SINGULARITY_RAD, Arm, as_right_arm
from ghest_rt.geometry.so3 import Array, exp_so3, quat_wxyz_from_matrix, rot_y, rot_z

# Half-angle sines below this are rounding: straight forward or straight backward.
_DEGENERATE = 1e-12


@dataclass(frozen=True, slots=True)
class SwingTwist:
    """Swing about an axis in the GH frame's x-y plane, then twist about the arm. A mirrored movement has the same values.

    Zero posture: the arm stretched forward and level. Singular only at tilt = pi (the arm straight backwards).

    Attributes:
        swing_flexion_rad: The swing's rotation vector along -y: upwards positive; |swing| <= pi.
        swing_abduction_rad: The swing's rotation vector along -x (left arm: +x): away from the midline positive.
        twist_rad: About the arm, internal positive, in (-pi, pi]; equals the torsion.
        tilt_rad: Length of the swing: between the arm and straight forward, in [0, pi].
        azimuth_rad: Direction in which z_arm (elbow to GH) leans, from up towards the left (left arm: towards the right), in
            (-pi, pi]; 0 at tilt 0.
        near_singularity: Tilt is within 10 deg of 180 deg: swing and twist are about to jump.
        azimuth_near_singularity: Tilt is within 10 deg of 0 or 180 deg: the azimuth says little.
    """

    swing_flexion_rad: float
    swing_abduction_rad: float
    twist_rad: float
    tilt_rad: float
    azimuth_rad: float
    near_singularity: bool
    azimuth_near_singularity: bool


def swing_twist(gh_from_arm: Array, arm: Arm) -> SwingTwist:
    """Decompose the (3, 3) rotation of the arm in the GH frame into swing and twist."""
    w, x, y, z = (float(q) for q in quat_wxyz_from_matrix(as_right_arm(gh_from_arm, arm)))
    # q = swing * twist with twist = (w, 0, 0, z) / cosine; what remains is swing = (cosine, swing_x, swing_y, 0).
    cosine, sine = math.hypot(w, z), math.hypot(x, y)
    if cosine > _DEGENERATE:
        twist = 2.0 * math.atan2(z, w)
        swing_x, swing_y = (x * w - y * z) / cosine, (x * z + y * w) / cosine
    else:
        twist, swing_x, swing_y = 0.0, x, y
    twist -= 2.0 * math.pi * math.copysign(1.0, twist) if abs(twist) > math.pi else 0.0
    tilt = 2.0 * math.atan2(sine, cosine)
    axis_x, axis_y = (swing_x / sine, swing_y / sine) if sine > _DEGENERATE else (0.0, 1.0)
    return SwingTwist(
        swing_flexion_rad=-tilt * axis_y,
        swing_abduction_rad=-tilt * axis_x,
        twist_rad=twist,
        tilt_rad=tilt,
        azimuth_rad=math.atan2(-axis_x, axis_y),
        near_singularity=tilt > math.pi - SINGULARITY_RAD,
        azimuth_near_singularity=not SINGULARITY_RAD < tilt < math.pi - SINGULARITY_RAD,
    )


def rotation_from_swing_twist(swing_flexion_rad: float, swing_abduction_rad: float, twist_rad: float, arm: Arm) -> Array:
    """Return the (3, 3) rotation gh_from_arm with this swing and twist."""
    swing = exp_so3(np.array([-swing_abduction_rad, -swing_flexion_rad, 0.0]))
    return as_right_arm(swing @ rot_z(twist_rad), arm)


def rotation_from_tilt_torsion(azimuth_rad: float, tilt_rad: float, torsion_rad: float, arm: Arm) -> Array:
    """Return the (3, 3) rotation gh_from_arm with this azimuth, tilt and torsion."""
    return as_right_arm(rot_z(azimuth_rad) @ rot_y(tilt_rad) @ rot_z(torsion_rad - azimuth_rad), arm)
