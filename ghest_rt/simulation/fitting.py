"""Adjust the exoskeleton to a patient: the prismatic settings of the station file."""

import re
from dataclasses import replace

from ghest_rt.config.load import LoadedStation, parse_station
from ghest_rt.errors import BadInputError
from ghest_rt.simulation.anatomy import Anatomy

_SETTINGS = re.compile(r"^settings_m\s*=\s*\{[^}]*\}", re.MULTILINE)


def fit_station(station: LoadedStation, body: Anatomy) -> LoadedStation:
    """Return the station with `exoskeleton.settings_m` set for this patient, in its text as well.

    Raises:
        BadInputError: The file does not set `settings_m` on one line.
    """
    settings = body.exoskeleton_settings_m()
    line = "settings_m = { " + ", ".join(f"{name} = {value!r}" for name, value in settings.items()) + " }"
    text, count = _SETTINGS.subn(line, station.toml_text)
    if count != 1:
        raise BadInputError(
            f"{station.source}: exoskeleton.settings_m must be set once, on one line, as settings_m = {{ name = metres, ... }}"
        )
    return replace(station, toml_text=text, config=parse_station(text, station.source))
