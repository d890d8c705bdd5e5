"""From the poses of a calibration session to what belongs into the station file; docs/calibration.md has the equations."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.calibration.arm_axis import ArmAxis
from ghest_rt.calibration.centre import SharedCentre, UnknowableCentreError, find_centre
from ghest_rt.calibration.hold import Hold
from ghest_rt.calibration.session import Session
from ghest_rt.config.station import Calibration
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.angles import euler_yxz
from ghest_rt.estimation.arm import ELW_FROM_ARM
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array

BLOCK_S = 1.0
"""Residuals that lie farther apart than this in time are taken as independent."""

MISALIGNED_M = 0.010
"""By how much the exoskeleton's elbow and the patient's are apart, per axis: of a well adjusted one."""
TAPE_M = 0.005
"""Standard deviation of an arm length measured with a tape."""

_LEAST_TURNING_RAD = math.radians(2.0)


@dataclass(frozen=True, slots=True)
class ArmLength:
    """From elbow to GH centre.

    Attributes:
        metres: The length.
        sigma_m: Its standard deviation.
        source: Where it came from, in words.
    """

    metres: float
    sigma_m: float
    source: str


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """What a session tells.

    Attributes:
        m0_from_gh: (4, 4) GH frame in m0.
        m1_from_elw: (4, 4) elbow frame in m1.
        length: The upper arm.
        elbow_in_link_m: (3,) elbow in the link of camera r1 in the neutral posture.
        elbow_in_link_sigma_m: (3,) how far it strayed there.
        forearm_twist_rad: Forearm out of the elbow frame's y-z plane in the neutral posture; None where it is not known.
        forearm_twist_sigma_rad: How much it strayed there; None where it is not known.
        elbow_bend_rad: Angle between upper arm and forearm in the neutral posture, 0 stretched; None where it is not known.
        gh: The GH centre in m0 and m1.
        pivot: The exoskeleton's elbow: the point shared by the link of camera r1 and m1; None where it cannot be known.
        pivot_off_rad: Angle between the arm and the line from that point to the GH centre; None where it cannot be known.
        hold: The neutral posture.
        range_rad: (3,) range of the GH angles a, b, g (docs/frames.md) over the session, 1st to 99th percentile.
    """

    m0_from_gh: Array
    m1_from_elw: Array
    length: ArmLength
    elbow_in_link_m: Array
    elbow_in_link_sigma_m: Array
    forearm_twist_rad: float | None
    forearm_twist_sigma_rad: float | None
    elbow_bend_rad: float | None
    gh: SharedCentre
    pivot: SharedCentre | None
    pivot_off_rad: float | None
    hold: Hold
    range_rad: Array


def solve(session: Session, hold: Hold, old: Calibration, elbow_from: ArmAxis, arm_length_m: float | None) -> Found:
    """Return what a session tells.

    Args:
        session: The poses.
        hold: The neutral posture in it.
        old: What the station file says so far: of the elbow along the arm, where nothing else tells it.
        elbow_from: What gives the arm's axis: the neutral posture, or the exoskeleton's elbow.
        arm_length_m: From elbow to GH centre as measured on the patient, or None.

    Raises:
        UnknowableCentreError: The shoulder has hardly moved.
        BadInputError: The exoskeleton's elbow is asked for and cannot be known.
    """
    block = np.floor(session.t_s / BLOCK_S).astype(np.int64)
    gh = find_centre(session.e_from_m0, session.e_from_m1, block)
    pivot = _pivot(session, block)
    # The neutral posture has all angles zero: arm and GH frame are E there.
    m1_from_elw_rotation = hold.e_from_m1.T @ ELW_FROM_ARM.T
    along = m1_from_elw_rotation[:, 1]
    if elbow_from is ArmAxis.EXOSKELETON:
        if pivot is None:
            raise BadInputError(
                "--elbow exoskeleton: the elbow has hardly moved, or about one axis alone, so that its centre is unknown; "
                "bend and stretch it by 25° both ways at the end of the session, or leave this option out"
            )
        along = gh.second_m - pivot.second_m
        pivot_length_m = float(np.linalg.norm(along))
        along /= pivot_length_m
        m1_from_elw_rotation = _with_y(m1_from_elw_rotation, along)
        length = ArmLength(pivot_length_m, _along_m(pivot, along), "exoskeleton's elbow")
        if arm_length_m is not None:
            length = ArmLength(arm_length_m, TAPE_M, "given (--arm-length)")
    else:
        length = _length(gh, pivot, along, old, arm_length_m)
    elbow_m = gh.second_m - length.metres * along
    m1_from_elw = transform(m1_from_elw_rotation, elbow_m)
    m0_from_gh = transform(hold.e_from_m0.T, gh.first_m)
    in_link_m, in_link_sigma_m = _elbow_in_link(session, hold, elbow_m)
    twist, twist_sigma, bend = _forearm(session, hold, m1_from_elw)
    return Found(
        m0_from_gh=m0_from_gh,
        m1_from_elw=m1_from_elw,
        length=length,
        elbow_in_link_m=in_link_m,
        elbow_in_link_sigma_m=in_link_sigma_m,
        forearm_twist_rad=twist,
        forearm_twist_sigma_rad=twist_sigma,
        elbow_bend_rad=bend,
        gh=gh,
        pivot=pivot,
        pivot_off_rad=None if pivot is None else _angle_rad(gh.second_m - pivot.second_m, hold.e_from_m1.T[:, 2]),
        hold=hold,
        range_rad=_range(session, m0_from_gh, m1_from_elw),
    )


def _pivot(session: Session, block: NDArray[np.int64]) -> SharedCentre | None:
    """Return the point shared by the link of camera r1 and m1, if it is known to within `MISALIGNED_M`.

    Noise of the rotations draws the centre towards the marker, the more the less they turn: hence the second condition.
    """
    try:
        pivot = find_centre(session.e_from_link, session.e_from_m1, block)
    except UnknowableCentreError:
        return None
    return pivot if pivot.second_sigma_m <= MISALIGNED_M and pivot.turning_rad >= _LEAST_TURNING_RAD else None


def _length(
    gh: SharedCentre, pivot: SharedCentre | None, along: Array, old: Calibration, measured_m: float | None
) -> ArmLength:
    """Return the arm's length from the best that tells it; the session itself does not."""
    if measured_m is not None:
        return ArmLength(measured_m, TAPE_M, "given (--arm-length)")
    if old.arm_length_m is not None:
        return ArmLength(old.arm_length_m, TAPE_M, "kept from the station file")
    if pivot is not None:
        return ArmLength(float(along @ (gh.second_m - pivot.second_m)), _along_m(pivot, along), "exoskeleton's elbow")
    kept_m = np.array(old.m1_from_elw)[:3, 3]
    return ArmLength(
        float(along @ (gh.second_m - kept_m)), MISALIGNED_M, "height of m1 above the elbow, kept from the station file"
    )


def _along_m(pivot: SharedCentre, along: Array) -> float:
    return math.sqrt(float(along @ pivot.covariance[3:, 3:] @ along) + MISALIGNED_M**2)


def _with_y(rotation: Array, y: Array) -> Array:
    """Return the frame with that y axis, its x axis as near as possible to that of a (3, 3) rotation."""
    x = rotation[:, 0] - (rotation[:, 0] @ y) * y
    x /= np.linalg.norm(x)
    return np.column_stack((x, y, np.cross(x, y)))


def _elbow_in_link(session: Session, hold: Hold, elbow_m: Array) -> tuple[Array, Array]:
    """Return the (3,) elbow in the link of camera r1 over the neutral posture: median and standard deviation."""
    link, m1 = session.e_from_link[hold.within], session.e_from_m1[hold.within]
    in_e = m1[:, :3, :3] @ elbow_m + m1[:, :3, 3]
    in_link = np.einsum("nji,nj->ni", link[:, :3, :3], in_e - link[:, :3, 3])
    return np.median(in_link, axis=0), in_link.std(axis=0)


def _forearm(session: Session, hold: Hold, m1_from_elw: Array) -> tuple[float | None, float | None, float | None]:
    """Return the forearm's twist (docs/frames.md), how it strayed, and the elbow's bend over the neutral posture."""
    if session.forearm_in_e is None:
        return None, None, None
    elw_from_e = m1_from_elw[:3, :3].T @ np.swapaxes(session.e_from_m1[hold.within][:, :3, :3], 1, 2)
    x, y, z = np.einsum("nij,nj->in", elw_from_e, session.forearm_in_e[hold.within])
    twist = np.arctan2(np.where(z < 0.0, -x, x), np.abs(z))
    return float(np.median(twist)), float(twist.std()), float(np.arccos(np.clip(-np.median(y), -1.0, 1.0)))


def _range(session: Session, m0_from_gh: Array, m1_from_elw: Array) -> Array:
    gh_from_e = m0_from_gh[:3, :3].T @ np.swapaxes(session.e_from_m0[:, :3, :3], 1, 2)
    gh_from_arm = gh_from_e @ session.e_from_m1[:, :3, :3] @ m1_from_elw[:3, :3] @ ELW_FROM_ARM
    angles = np.array([(e.a_rad, e.b_rad, e.g_rad) for e in map(euler_yxz, gh_from_arm)])
    low, high = np.percentile(np.unwrap(angles, axis=0), (1.0, 99.0), axis=0)
    return np.asarray(high - low)


def _angle_rad(u: Array, v: Array) -> float:
    return math.atan2(float(np.linalg.norm(np.cross(u, v))), float(u @ v))
