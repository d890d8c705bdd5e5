"""What a calibration changes and how well it is known, row by row, and what the session could not tell."""

import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.calibration.solve import Found
from ghest_rt.config.station import Calibration
from ghest_rt.geometry.so3 import Array, angle_between_rad


@dataclass(frozen=True, slots=True)
class Row:
    """One quantity; texts ready to be shown.

    Attributes:
        quantity: What it is.
        before: In the old station file; "" where it says nothing.
        after: In the new one.
        change: By how much they differ.
        sigma: Standard deviation within this session; what no session can tell is named in the notes.
    """

    quantity: str
    before: str
    after: str
    change: str
    sigma: str


def rows_of(old: Calibration, found: Found) -> list[Row]:
    """Return the rows of the table; what was found need not be a calibration that a station file takes."""
    sigma = np.sqrt(np.diag(found.gh.covariance))
    hold = found.hold
    attitude = "{:.2f}° held"
    m1 = found.m1_from_elw
    elbow_sigma_m = np.sqrt(np.square(sigma[3:]) + np.square(found.length.sigma_m * m1[:3, 1]))
    rows = [
        _place("GH centre in m0, mm", np.array(old.m0_from_gh)[:3, 3], found.gh.first_m, sigma[:3]),
        _place("GH centre in m1, mm", _gh_in_m1(old), found.gh.second_m, sigma[3:]),
        _attitude("GH frame, turned in m0", old.m0_from_gh, found.m0_from_gh, attitude.format(math.degrees(hold.m0_rad))),
        _attitude("elbow frame, turned in m1", old.m1_from_elw, m1, attitude.format(math.degrees(hold.m1_rad))),
        _place("elbow in m1, mm", np.array(old.m1_from_elw)[:3, 3], m1[:3, 3], elbow_sigma_m),
        _length(old, found),
        _elbow_in_link(old, found),
    ]
    if found.forearm_twist_rad is not None and found.forearm_twist_sigma_rad is not None:
        before = old.reference.forearm_twist_deg
        after = math.degrees(found.forearm_twist_rad)
        change = "" if before is None else f"{after - before:+.2f}°"
        strayed = f"{math.degrees(found.forearm_twist_sigma_rad):.2f}° held"
        rows.append(Row("forearm twist", "" if before is None else f"{before:.2f}°", f"{after:.2f}°", change, strayed))
    return rows


def notes_of(found: Found) -> list[str]:
    """Return what the session could not tell, or tells of the exoskeleton."""
    notes = [
        "kept from the station file: link_from_camera (camera mounts), and the tolerances elbow_sigma_m and forearm_sigma_deg",
        "zero of all angles: the posture held at the beginning; by what it was off true neutral, every later angle is off, too",
        f"elbow along the arm: {found.length.source}; the angles do not depend on it",
    ]
    if found.pivot is None or found.pivot_off_rad is None:
        notes.append(
            "NOT CHECKED: whether the arm pointed forward and level in the neutral posture (the elbow has hardly moved, or "
            "about one axis alone, so that the exoskeleton's elbow is unknown); by what it was off, every later angle is off"
        )
    else:
        apart = np.linalg.norm(found.pivot.second_m - found.m1_from_elw[:3, 3])
        notes.append(
            f"the exoskeleton's elbow is {1000 * apart:.0f} mm from the elbow found, {math.degrees(found.pivot_off_rad):.1f}° "
            "from the arm's axis as seen from the GH centre"
        )
    if found.forearm_twist_rad is None:
        notes.append(
            "NOT CHECKED: how the arm was turned about its own axis in the neutral posture, and whether the elbow was "
            "bent: the exoskeleton does not know the forearm"
        )
    return notes


def _gh_in_m1(calibration: Calibration) -> Array | None:
    """Return the (3,) GH centre in m1: from the elbow up the arm; None where the arm's length is not calibrated."""
    if calibration.arm_length_m is None:
        return None
    m1_from_elw = np.array(calibration.m1_from_elw)
    return np.asarray(m1_from_elw[:3, 3] + calibration.arm_length_m * m1_from_elw[:3, 1])


def _place(quantity: str, before: Array | None, after: Array | None, sigma: Array) -> Row:
    change = "" if before is None or after is None else f"{1000 * np.linalg.norm(after - before):.1f}"
    return Row(quantity, _mm(before), _mm(after), change, _mm(sigma, digits=2))


def _mm(point_m: Array | None, digits: int = 1) -> str:
    return "" if point_m is None else " ".join(f"{1000 * v + 0.0:.{digits}f}" for v in point_m.tolist())


def _attitude(quantity: str, before: object, after: object, sigma: str) -> Row:
    R_before, R_after = np.array(before)[:3, :3], np.array(after)[:3, :3]
    turned = math.degrees(angle_between_rad(R_after, R_before))
    return Row(quantity, _tilt(R_before), _tilt(R_after), f"{turned:.2f}°", sigma)


def _tilt(R: Array) -> str:
    return f"{math.degrees(angle_between_rad(R, np.eye(3))):.2f}°"


def _length(old: Calibration, found: Found) -> Row:
    before, after = old.arm_length_m, found.length.metres
    return Row(
        "elbow to GH centre, mm",
        "" if before is None else f"{1000 * before:.1f}",
        f"{1000 * after:.1f}",
        "" if before is None else f"{1000 * (after - before):+.1f}",
        f"{1000 * found.length.sigma_m:.1f}",
    )


def _elbow_in_link(old: Calibration, found: Found) -> Row:
    before = old.reference.elbow_in_link_m
    return _place(
        "elbow in link of r1, mm",
        None if before is None else np.array(before),
        found.elbow_in_link_m,
        found.elbow_in_link_sigma_m,
    )
