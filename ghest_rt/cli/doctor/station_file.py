"""The station file and what it refers to, as far as no device is needed."""

import re
from collections.abc import Iterator
from pathlib import Path

from ghest_rt.cli.doctor.findings import Finding, missing, note, ok
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.errors import BadInputError, GhestError, NotPermittedError
from ghest_rt.service.station_check import check_station

# In the name of the file or of the robot, and in what is written in the file: "armeo_spring_left", "Armeo Spring, right arm".
_SIDE_IN_NAME = re.compile(r"(?:^|[_\-. ])(left|right)(?=$|[_\-. ])", re.IGNORECASE)
_SIDE_IN_TEXT = re.compile(r"\b(left|right)\s+(?:arm|side)\b", re.IGNORECASE)
_ROBOT = re.compile(r"<robot\b[^>]*\bname\s*=\s*[\"']([^\"']*)")


def look_at_station(path: Path | None) -> tuple[LoadedStation | None, list[Finding]]:
    """Return the station and what is to be said of its file; without a file, nothing."""
    if path is None:
        return None, []
    try:
        station = load_station(path)
    except BadInputError as error:
        return None, [missing("station file", str(error), "correct it; the files in config/ are examples", exit_code=2)]
    return station, list(_of(station))


def _of(station: LoadedStation) -> Iterator[Finding]:
    config = station.config
    yield ok("station file", f"{station.source}: station {config.station.id}, {config.station.arm} arm")
    try:
        check_station(station)
    except NotPermittedError as error:
        yield note("station file's parts", str(error), "look again as the service's user, or as root")
    except GhestError as error:
        remedy = "correct it; the service would end with this message"
        yield missing("station file's parts", str(error), remedy, error.exit_code)
    else:
        yield ok("station file's parts", "geometry, encoders, keys: they fit each other")
    told = _side_told(station)
    if told is not None and told != config.station.arm:
        detail = f"station.arm is {config.station.arm}, and {config.exoskeleton.urdf} calls itself one for the {told} arm"
        yield note("arm", detail, "correct station.arm or exoskeleton.urdf; it sets the signs of abduction and rotation")


def _side_told(station: LoadedStation) -> str | None:
    """Return the side that the URDF names; None if it names none or both."""
    robot = _ROBOT.search(station.urdf_text)
    names = (Path(station.config.exoskeleton.urdf).stem, robot[1] if robot else "")
    found = [side for name in names for side in _SIDE_IN_NAME.findall(name)] or _SIDE_IN_TEXT.findall(station.urdf_text)
    sides = {side.lower() for side in found}
    return sides.pop() if len(sides) == 1 else None
