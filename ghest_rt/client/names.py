"""Names of stations, as a segment of Zenoh's keys."""

import re

from ghest_rt.errors import BadInputError

_STATION = re.compile(r"[A-Za-z0-9_-]{1,64}|\*")


def check_station(name: str) -> str:
    """Return a station's id, or "*" for every station.

    Raises:
        BadInputError: It can be no station's.
    """
    if not _STATION.fullmatch(name):
        raise BadInputError(f"{name!r} is not a station id: letters, digits, _ and -, or * for every station")
    return name
