"""The ISB's angles of the GH joint: Y-X-Y after Wu et al., J. Biomech. 38 (2005), 981-992, section 2.4.7.

Axes. ISB thorax or scapula frame: X forwards, Y up, Z to the right. In terms of our GH frame (x up, y left, z backwards):
X = -z, Y = x, Z = -y. ISB humerus frame: Y from elbow to GH, Z along the elbow's flexion axis, to the right when the arm hangs;
in terms of our arm frame: X = y, Y = z, Z = x. A left arm is mirrored at the sagittal plane first, as the ISB recommends.
"""

import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.estimation.angles import SINGULARITY_RAD, Arm, as_right_arm
from ghest_rt.geometry.so3 import Array, rot_x, rot_y

_ISB_FROM_GH = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
_ARM_FROM_HUMERUS = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True, slots=True)
class IsbYxy:
    """ISB angles, R = Ry(plane) Rx(-elevation) Ry(axial), intrinsic.

    Zero posture: the arm hanging. Our zero posture (stretched forward and level) has plane 90, elevation 90, axial 0 deg.
    Singular at elevation 0 (hanging) and 180 deg, where only the sum or the difference of plane and axial is determined; there
    axial is taken to be 0.

    Attributes:
        plane_of_elevation_rad: 0 = abduction, pi/2 = forward flexion; in (-pi, pi].
        elevation_rad: Between the arm and straight down, in [0, pi]; Wu's own sign of the second angle is the opposite.
        axial_rotation_rad: Internal positive, in (-pi, pi].
        near_singularity: Elevation is within 10 deg of 0 or 180 deg.
    """

    plane_of_elevation_rad: float
    elevation_rad: float
    axial_rotation_rad: float
    near_singularity: bool


def isb_yxy(gh_from_arm: Array, arm: Arm) -> IsbYxy:
    """Decompose the (3, 3) rotation of the arm in the GH frame into the ISB's angles."""
    R = _ISB_FROM_GH @ as_right_arm(gh_from_arm, arm) @ _ARM_FROM_HUMERUS
    sine = math.hypot(float(R[0, 1]), float(R[2, 1]))
    elevation = math.atan2(sine, float(R[1, 1]))
    if sine > 1e-9:
        plane = math.atan2(-float(R[0, 1]), -float(R[2, 1]))
        axial = math.atan2(-float(R[1, 0]), float(R[1, 2]))
    else:
        plane = math.atan2(-float(R[2, 0]), float(R[0, 0]))
        axial = 0.0
    return IsbYxy(plane, elevation, axial, sine < math.sin(SINGULARITY_RAD))


def rotation_from_isb_yxy(plane_of_elevation_rad: float, elevation_rad: float, axial_rotation_rad: float, arm: Arm) -> Array:
    """Return the (3, 3) rotation gh_from_arm that has these ISB angles."""
    R = rot_y(plane_of_elevation_rad) @ rot_x(-elevation_rad) @ rot_y(axial_rotation_rad)
    return as_right_arm(_ISB_FROM_GH.T @ R @ _ARM_FROM_HUMERUS.T, arm)
