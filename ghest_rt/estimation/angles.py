"""The angles of the GH joint: the paper's y-x-z sequence and its clinical names. Conventions in docs/angles.md."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ghest_rt.config.station import Joint
from ghest_rt.geometry.so3 import Array, rot_x, rot_y, rot_z

Arm = Literal["right", "left"]

# Nearer than this to a singularity, an error of the rotation may appear 1 / sin(10 deg) = 5.8 times enlarged and more.
SINGULARITY_RAD = math.radians(10.0)

# Rotations seen in a mirror at the sagittal plane (y to -y in E, GH and arm frames): signs of the elements of M R M.
_MIRROR = np.array([[1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, 1.0]])


def as_right_arm(gh_from_arm: Array, arm: Arm) -> Array:
    """Return the (3, 3) rotation that a right arm would have: a left arm's seen in a mirror at the sagittal plane."""
    return gh_from_arm if arm == "right" else gh_from_arm * _MIRROR


@dataclass(frozen=True, slots=True)
class EulerYxz:
    """The paper's angles, gh_from_arm = Ry(a) Rx(b) Rz(g), intrinsic; section 3.3.4 (4).

    Zero posture: the arm stretched forward and level. Singular at b = ±90 deg (arm straight to the side), where only a - g or
    a + g is determined; there g is taken to be 0.

    Attributes:
        a_rad: About y, in (-pi, pi].
        b_rad: About the moved x, in [-pi/2, pi/2].
        g_rad: About the moved z = the arm, in (-pi, pi].
        near_singularity: b is within 10 deg of ±90 deg.
    """

    a_rad: float
    b_rad: float
    g_rad: float
    near_singularity: bool


@dataclass(frozen=True, slots=True)
class AngleSigns:
    """What turns (a, b, g) of a right side into flexion, abduction and rotation; b and g change sign on the left."""

    flexion: int = -1
    abduction: int = -1
    rotation: int = 1


GH_SIGNS = AngleSigns()
"""Of the glenohumeral joint."""


def signs_of(joint: Joint) -> AngleSigns:
    """Return the signs that the station file gives the angles of its joint."""
    return AngleSigns(joint.flexion_sign, joint.abduction_sign, joint.rotation_sign)


@dataclass(frozen=True, slots=True)
class ClinicalAngles:
    """The same angles with clinical signs: a mirrored movement of the other arm has the same values.

    Attributes:
        flexion_rad: Raising the arm forwards; 0 level, -pi/2 hanging; -a. In [-pi, pi).
        abduction_rad: Horizontal, away from the midline; -b for a right arm, +b for a left one. In [-pi/2, pi/2].
        rotation_rad: Internal rotation about the arm; +g for a right arm, -g for a left one. In [-pi, pi].
        near_singularity: Abduction is within 10 deg of ±90 deg.
    """

    flexion_rad: float
    abduction_rad: float
    rotation_rad: float
    near_singularity: bool


def euler_yxz(gh_from_arm: Array) -> EulerYxz:
    """Decompose a (3, 3) rotation into Ry(a) Rx(b) Rz(g): a = atan2(Vx, Vz), b = -asin(Vy), V its z axis."""
    vx, vy, vz = (float(v) for v in gh_from_arm[:, 2])
    cosine_b = math.hypot(vx, vz)
    b = math.atan2(-vy, cosine_b)
    if cosine_b > 1e-9:
        a = math.atan2(vx, vz)
        g = math.atan2(float(gh_from_arm[1, 0]), float(gh_from_arm[1, 1]))
    else:
        a = math.atan2(-float(gh_from_arm[2, 0]), float(gh_from_arm[0, 0]))
        g = 0.0
    return EulerYxz(a, b, g, cosine_b < math.sin(SINGULARITY_RAD))


def rotation_from_euler_yxz(a_rad: float, b_rad: float, g_rad: float) -> Array:
    """Return the (3, 3) rotation Ry(a) Rx(b) Rz(g)."""
    return rot_y(a_rad) @ rot_x(b_rad) @ rot_z(g_rad)


def clinical(euler: EulerYxz, arm: Arm, signs: AngleSigns = GH_SIGNS) -> ClinicalAngles:
    """Return the clinical names and signs of the paper's angles."""
    side = 1.0 if arm == "right" else -1.0
    return ClinicalAngles(
        signs.flexion * euler.a_rad,
        signs.abduction * side * euler.b_rad,
        signs.rotation * side * euler.g_rad,
        euler.near_singularity,
    )


def rotation_from_clinical(flexion_rad: float, abduction_rad: float, rotation_rad: float, arm: Arm) -> Array:
    """Return the (3, 3) rotation gh_from_arm that has these clinical angles."""
    side = 1.0 if arm == "right" else -1.0
    return rotation_from_euler_yxz(-flexion_rad, -side * abduction_rad, side * rotation_rad)
