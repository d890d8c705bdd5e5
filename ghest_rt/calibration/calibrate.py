"""A calibration session and a station file make a new station file."""

import math
import re
from dataclasses import dataclass
from pathlib import Path

from ghest_rt.calibration.centre import UnknowableCentreError
from ghest_rt.calibration.hold import Hold, find_hold
from ghest_rt.calibration.options import CalibrationOptions
from ghest_rt.calibration.session import Session
from ghest_rt.calibration.solve import Found, solve
from ghest_rt.calibration.station_text import rigid_rows, with_calibration
from ghest_rt.calibration.verdict import Objection, Refusal, object_to_hold, object_to_movement, object_to_view
from ghest_rt.config.load import LoadedStation, parse_station
from ghest_rt.config.station import Calibration
from ghest_rt.errors import BadInputError

_GH = "gh"


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What became of a session.

    Attributes:
        objections: Why it is not used; () if it is.
        found: What it tells; None where not even that could be made out.
        calibration: The new calibration; None where there are objections: its numbers may be no calibration's at all.
    """

    objections: tuple[Objection, ...]
    found: Found | None
    calibration: Calibration | None


def calibrate(session: Session, station: LoadedStation, options: CalibrationOptions) -> Outcome:
    """Return the calibration that a session gives, and whether it is to be used.

    Raises:
        BadInputError: An option does not fit the session.
    """
    objections = object_to_view(session)
    hold = find_hold(session)
    objections += object_to_hold(hold)
    if hold is None:
        return Outcome(tuple(objections), None, None)
    old = station.config.calibration
    try:
        found = solve(session, hold, old, options.elbow_from, options.arm_length_m)
    except UnknowableCentreError as error:
        text = f"{error}: move the shoulder through flexion, abduction and rotation after the neutral posture"
        objections.append(Objection(Refusal.RANGE_TOO_SMALL, text))
        return Outcome(tuple(objections), None, None)
    objections += object_to_movement(found, posture_unchecked=options.posture_unchecked)
    calibration = None if objections else _calibration(found, old, options.calibration_id)
    return Outcome(tuple(objections), found, calibration)


def check_joint(station: LoadedStation) -> None:
    """Refuse a station that measures anything but the shoulder.

    Raises:
        BadInputError: It does.
    """
    joint = station.config.joint.name
    if joint != _GH:
        raise BadInputError(f"{station.source}: joint.name is {joint}: only the shoulder ({_GH}) has a calibration session")


def new_station_text(station: LoadedStation, calibration: Calibration, hold: Hold, recording: str) -> str:
    """Return the station file's text with the calibration.

    Raises:
        BadInputError: The file is not written in a way that can be changed.
    """
    name = "".join(letter if letter.isprintable() else "?" for letter in recording)
    remark = (
        f"from {name}, neutral posture held from {hold.start_s:.1f} to {hold.end_s:.1f} s (docs/calibration.md). "
        "Numbers in comments below are those of the mounting."
    )
    text = with_calibration(station.toml_text, station.source, calibration, remark)
    parse_station(text, station.source)
    return text


def id_from(recording: Path, old_id: str) -> str:
    """Return a calibration id made of the recording's name, unlike the old one."""
    name = re.sub(r"[^A-Za-z0-9_-]+", "-", recording.stem).strip("-")[:60] or "session"
    return name if name != old_id else f"{name}-2"


def _calibration(found: Found, old: Calibration, calibration_id: str) -> Calibration:
    reference = {
        **old.reference.model_dump(),
        "elbow_in_link_m": tuple(round(v, 5) + 0.0 for v in found.elbow_in_link_m.tolist()),
    }
    if found.forearm_twist_rad is not None:
        reference["forearm_twist_deg"] = round(math.degrees(found.forearm_twist_rad), 3)
    return Calibration.model_validate(
        {
            **old.model_dump(),
            "id": calibration_id,
            "m0_from_gh": rigid_rows(found.m0_from_gh),
            "m1_from_elw": rigid_rows(found.m1_from_elw),
            "arm_length_m": round(found.length.metres, 7),
            "reference": reference,
        }
    )
