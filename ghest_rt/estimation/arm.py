"""The upper arm: equations (8), (9), (10) of the paper and its steps 3.3.4 (3) to (5)."""

import math

import numpy as np

from ghest_rt.geometry.se3 import inverse
from ghest_rt.geometry.so3 import Array

ELW_FROM_ARM = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""(3, 3) axes of the arm in the elbow frame, docs/frames.md: y of the elbow frame is z of the arm."""
ELW_FROM_ARM.flags.writeable = False

# Shorter than this (metres), GH centre and elbow are one point and give no direction.
_SHORTEST_ARM_M = 1e-3
# The sine below which the marker's x axis lies along the arm and gives no twist.
_LEAST_SINE = 1e-3


def eq8_e_from_gh(e_from_m0: Array, m0_from_gh: Array) -> Array:
    """Equation (8), T_G^E = T_m0^E * T_G^m0: the GH joint frame in E.

    Args:
        e_from_m0: (4, 4) marker m0 in E, equation (7).
        m0_from_gh: (4, 4) GH joint frame in the m0 frame, by calibration.

    Returns:
        (4, 4); its origin p_G^E is the GH joint centre, metres.
    """
    return e_from_m0 @ m0_from_gh


def eq9_e_from_elw(e_from_m1: Array, m1_from_elw: Array) -> Array:
    """Equation (9), T_elw^E = T_m1^E * T_elw^m1: the elbow frame in E.

    Args:
        e_from_m1: (4, 4) marker m1 in E, equation (7).
        m1_from_elw: (4, 4) elbow frame in the m1 frame, by calibration.

    Returns:
        (4, 4); its origin p_elw^E is the elbow centre and its x axis the arm's, metres.
    """
    return e_from_m1 @ m1_from_elw


def step3_4_5_e_from_arm(e_from_gh: Array, e_from_elw: Array) -> Array | None:
    """Steps 3.3.4 (3) to (5), T_arm^E: the upper arm in E.

    (3) V = unit(p_G - p_elw); the origin is the middle between the two. (4) Ry(a) Rx(b) turn the z axis of E onto V;
    g turns the moved x axis about V until it lies in the plane of V and the x axis that marker m1 carries: the twist *about V*
    (the paper projects onto the fixed x-y plane, which is not what it means). Ry(a) Rx(b) Rz(g) is therefore the frame with
    z = V and x = that axis made perpendicular to V, built here without the angles and so without their singularity.

    The x axis that m1 carries is the elbow frame's; it is m1's own where the marker sits as docs/frames.md says.

    Args:
        e_from_gh: (4, 4) GH joint frame in E, equation (8).
        e_from_elw: (4, 4) elbow frame in E, equation (9).

    Returns:
        (4, 4), metres; None if the two centres coincide or the x axis lies along the arm: no frame then.
    """
    gx, gy, gz = e_from_gh[:3, 3].tolist()
    ex, ey, ez = e_from_elw[:3, 3].tolist()
    vx, vy, vz = gx - ex, gy - ey, gz - ez
    length = math.sqrt(vx * vx + vy * vy + vz * vz)
    if not length > _SHORTEST_ARM_M:
        return None
    vx, vy, vz = vx / length, vy / length, vz / length
    ux, uy, uz = e_from_elw[:3, 0].tolist()
    along = ux * vx + uy * vy + uz * vz
    xx, xy, xz = ux - along * vx, uy - along * vy, uz - along * vz
    sine = math.sqrt(xx * xx + xy * xy + xz * xz)
    if not sine > _LEAST_SINE:
        return None
    xx, xy, xz = xx / sine, xy / sine, xz / sine
    return np.array(
        [
            [xx, vy * xz - vz * xy, vx, 0.5 * (gx + ex)],
            [xy, vz * xx - vx * xz, vy, 0.5 * (gy + ey)],
            [xz, vx * xy - vy * xx, vz, 0.5 * (gz + ez)],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def eq10_m0_from_arm(e_from_m0: Array, e_from_arm: Array) -> Array:
    """Equation (10), T_arm^m0 = T_E^m0 * T_arm^E: the upper arm with respect to the acromion.

    Args:
        e_from_m0: (4, 4) marker m0 in E, equation (7).
        e_from_arm: (4, 4) upper arm in E, steps (3) to (5).

    Returns:
        (4, 4) upper arm in the m0 frame, metres.
    """
    return np.asarray(inverse(e_from_m0).dot(e_from_arm))


def gh_from_arm_rotation(m0_from_gh: Array, m0_from_arm: Array) -> Array:
    """Return the (3, 3) rotation of the arm in the GH frame, whose angles are the GH angles.

    Args:
        m0_from_gh: (4, 4) GH joint frame in the m0 frame, by calibration.
        m0_from_arm: (4, 4) upper arm in the m0 frame, equation (10).
    """
    return np.asarray(m0_from_gh[:3, :3].T.dot(m0_from_arm[:3, :3]))
