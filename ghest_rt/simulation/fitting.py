"""Adjust a station file to what is simulated: the exoskeleton's settings for a patient, cameras without depth."""

import re
from dataclasses import replace

from ghest_rt.config.load import LoadedStation, parse_station
from ghest_rt.errors import BadInputError
from ghest_rt.simulation.anatomy import Anatomy

_CAMERA = re.compile(r"^(\[cameras\.[^\]]+\].*)$", re.MULTILINE)
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


def without_depth(station: LoadedStation) -> LoadedStation:
    """Return the station with `depth = false` for every camera, in its text as well.

    Raises:
        BadInputError: A camera has no `[cameras.<name>]` table of its own, or says something of depth already.
    """
    text = _CAMERA.sub(r"\1\ndepth = false", station.toml_text)
    config = parse_station(text, station.source)
    left = [name for name, camera in config.cameras.items() if camera.depth]
    if left:
        raise BadInputError(f"{station.source}: write camera {', '.join(left)} as a table [cameras.{left[0]}] of its own")
    return replace(station, toml_text=text, config=config)
