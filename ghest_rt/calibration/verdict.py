"""Whether a calibration session is good enough to be used, and why not: each reason with its remedy."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ghest_rt.calibration.hold import BEGINS_WITHIN_S, LEAST_S, STILL_RAD, Hold
from ghest_rt.calibration.session import Session
from ghest_rt.calibration.solve import Found
from ghest_rt.geometry.so3 import Array

LEAST_SEEN = 0.6
"""Share of the session during which both markers must be known."""
LEAST_SEEN_S = 8.0
"""And so many seconds of it."""
LEAST_RANGE_RAD = math.radians(15.0)
"""Range of flexion, abduction and rotation each."""
LEAST_TURNING_RAD = math.radians(4.0)
"""Root mean square turning about other axes than the first."""
GREATEST_SIGMA_M = 0.003
"""Standard deviation of the GH centre in either marker, worst direction."""
GREATEST_RESIDUAL_M = 0.006
"""Root mean square distance between the GH centres of the two markers."""
LEAST_USED = 0.8
"""Share of the instants that are no outliers."""
GREATEST_POSTURE_RAD = math.radians(15.0)
"""What the exoskeleton's elbow and forearm may be off the neutral posture."""
BENT_RAD = (math.radians(50.0), math.radians(130.0))
"""Elbow in the neutral posture."""
LEAST_ARM_M, GREATEST_ARM_M = 0.15, 0.50
GREATEST_CENTRE_M = 0.30
"""Farther from its marker m0 the GH centre cannot be."""
GREATEST_ELBOW_M = 0.40
"""Farther from its marker m1 the elbow cannot be."""
GREATEST_LINK_M = 0.80
"""Farther from the link that carries camera r1 it cannot be, either."""


class Refusal(StrEnum):
    """Why a session is not used."""

    SEEN_TOO_SELDOM = "seen_too_seldom"
    NOT_STILL = "not_still"
    RANGE_TOO_SMALL = "range_too_small"
    CENTRE_UNCERTAIN = "centre_uncertain"
    RESIDUAL_TOO_LARGE = "residual_too_large"
    NOT_NEUTRAL = "not_neutral"
    POSTURE_UNCHECKED = "posture_unchecked"
    ELBOW_NOT_BENT = "elbow_not_bent"
    IMPLAUSIBLE = "implausible"


@dataclass(frozen=True, slots=True)
class Objection:
    """One reason against a session.

    Attributes:
        refusal: Which.
        text: What was seen, and what to do.
    """

    refusal: Refusal
    text: str


def object_to_view(session: Session) -> list[Objection]:
    """Return what is wrong with what was seen at all."""
    if session.seen_fraction >= LEAST_SEEN and session.seen_s >= LEAST_SEEN_S:
        return []
    reasons = ", ".join(f"{reason} x{count}" for reason, count in sorted(session.missing.items(), key=lambda item: -item[1]))
    text = (
        f"both markers are known during {100 * session.seen_fraction:.0f} % of the session only, {session.seen_s:.1f} s"
        f"{f' (missing: {reasons})' if reasons else ''}; at least {100 * LEAST_SEEN:.0f} % and {LEAST_SEEN_S:g} s are needed: "
        "look at both cameras' views (`ghest-rt doctor --live 5`, Foxglove) and record again"
    )
    return [Objection(Refusal.SEEN_TOO_SELDOM, text)]


def object_to_hold(hold: Hold | None) -> list[Objection]:
    """Return what is wrong with the neutral posture."""
    if hold is not None:
        return []
    text = (
        f"no posture is held still for {LEAST_S:g} s within the first {BEGINS_WITHIN_S:g} s (both markers known for most of "
        f"it, within {math.degrees(STILL_RAD):.1f}° RMS): begin the session in the neutral posture, supported, and hold it for "
        "4 s in both cameras' views"
    )
    return [Objection(Refusal.NOT_STILL, text)]


def object_to_movement(found: Found, *, posture_unchecked: bool) -> list[Objection]:
    """Return what is wrong with the rest.

    Args:
        found: What the session tells.
        posture_unchecked: Whether a neutral posture that nothing vouches for is taken.
    """
    return [
        *_range(found.range_rad),
        *_centre(found),
        *_posture(found, unchecked=posture_unchecked),
        *_geometry(found),
    ]


def _geometry(found: Found) -> list[Objection]:
    """Refuse what no limb is like; what is left, the station file takes."""
    arm_m, m0_m = found.length.metres, float(np.linalg.norm(found.gh.first_m))
    m1_m, link_m = float(np.linalg.norm(found.m1_from_elw[:3, 3])), float(np.linalg.norm(found.elbow_in_link_m))
    possible = (
        LEAST_ARM_M <= arm_m <= GREATEST_ARM_M
        and m0_m <= GREATEST_CENTRE_M
        and m1_m <= GREATEST_ELBOW_M
        and link_m <= GREATEST_LINK_M
    )
    if possible:
        return []
    text = (
        f"a GH centre {1000 * m0_m:.0f} mm from m0 and {1000 * arm_m:.0f} mm from the elbow, the elbow {1000 * m1_m:.0f} mm "
        f"from m1 and {1000 * link_m:.0f} mm from camera r1's link, is no shoulder's: look at markers.*.half_spacing_m, "
        "calibration.link_from_camera, which camera is which, and whether the encoders move"
    )
    return [Objection(Refusal.IMPLAUSIBLE, text)]


def _range(range_rad: Array) -> list[Objection]:
    small = [
        f"{name} {math.degrees(rad):.0f}°"
        for name, rad in zip(("flexion", "abduction", "rotation"), range_rad.tolist(), strict=True)
        if rad < LEAST_RANGE_RAD
    ]
    if not small:
        return []
    text = (
        f"the range of {', '.join(small)} is too small: move through {math.degrees(LEAST_RANGE_RAD):.0f}° of each at least, "
        "better 40°"
    )
    return [Objection(Refusal.RANGE_TOO_SMALL, text)]


def _centre(found: Found) -> list[Objection]:
    objections = []
    turning_rad = found.gh.turning_rad
    if turning_rad < LEAST_TURNING_RAD:
        text = (
            f"the arm turned by {math.degrees(turning_rad):.1f}° RMS only about other axes than one, "
            f"{math.degrees(LEAST_TURNING_RAD):.0f}° are needed: move in all three directions, one after the other"
        )
        objections.append(Objection(Refusal.RANGE_TOO_SMALL, text))
    sigma_m = max(found.gh.first_sigma_m, found.gh.second_sigma_m)
    if not sigma_m <= GREATEST_SIGMA_M:
        text = (
            f"the GH centre is known to {1000 * sigma_m:.1f} mm only, {1000 * GREATEST_SIGMA_M:.0f} mm are needed: "
            "move farther and longer, slowly"
        )
        objections.append(Objection(Refusal.CENTRE_UNCERTAIN, text))
    rms_m, used = found.gh.residual_rms_m, float(found.gh.used.mean())
    if not rms_m <= GREATEST_RESIDUAL_M or used < LEAST_USED:
        text = (
            f"the markers' GH centres are {1000 * rms_m:.1f} mm RMS apart, {100 * (1 - used):.0f} % of the samples are outliers"
            f" (at most {1000 * GREATEST_RESIDUAL_M:.0f} mm and {100 * (1 - LEAST_USED):.0f} %): a marker has moved on the"
            " skin, or a camera mount or encoder is wrong; fasten the markers anew, check the mounts, and record again"
        )
        objections.append(Objection(Refusal.RESIDUAL_TOO_LARGE, text))
    return objections


def _posture(found: Found, *, unchecked: bool) -> list[Objection]:
    objections = []
    if found.pivot_off_rad is None and not unchecked:  # the forearm cannot see where the arm points
        text = (
            "whether the arm pointed forward and level in the neutral posture cannot be checked, since the elbow has hardly "
            "moved, or about one axis alone: bend and stretch it by 25° both ways at the end of the session, or, if a spirit "
            "level has shown the posture to be right, add --posture-unchecked"
        )
        objections.append(Objection(Refusal.POSTURE_UNCHECKED, text))
    off = {
        "the arm points": found.pivot_off_rad,
        "the forearm stands": None if found.forearm_twist_rad is None else abs(found.forearm_twist_rad),
    }
    wrong = [f"{what} {math.degrees(rad):.0f}°" for what, rad in off.items() if rad is not None and rad > GREATEST_POSTURE_RAD]
    if wrong:
        text = (
            f"{' and '.join(wrong)} off the neutral posture (at most {math.degrees(GREATEST_POSTURE_RAD):.0f}°): hold the arm "
            "stretched forward and level, the bent forearm level and pointing inwards, from the first second of the session on"
        )
        objections.append(Objection(Refusal.NOT_NEUTRAL, text))
    bend = found.elbow_bend_rad
    if bend is not None and not BENT_RAD[0] <= bend <= BENT_RAD[1]:
        text = f"the elbow is bent by {math.degrees(bend):.0f}° in the neutral posture: bend it by about 90°"
        objections.append(Objection(Refusal.ELBOW_NOT_BENT, text))
    return objections
