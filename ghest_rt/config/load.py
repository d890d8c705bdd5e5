"""Read a station file; every problem is told with file, key path and remedy."""

import json
import stat
import tomllib
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from ghest_rt.config.problems import problems_in_words
from ghest_rt.config.station import StationConfig
from ghest_rt.errors import BadInputError

_MAX_BYTES = 1_000_000
_MAX_DOTS = 200  # in one line: the parser's time grows with the square of a dotted key's length


@dataclass(frozen=True, slots=True)
class LoadedStation:
    """A station file with what it refers to, so that a recording can carry both.

    Attributes:
        config: The parsed file.
        toml_text: The file as it was written.
        urdf_text: The URDF it names.
        source: Where it came from, for messages.
    """

    config: StationConfig
    toml_text: str
    urdf_text: str
    source: str


def parse_station(toml_text: str, source: str) -> StationConfig:
    """Parse a station file's text.

    Raises:
        BadInputError: Not TOML, or a key is missing, unknown or out of range; names `source` and each key.
    """
    for number, line in enumerate(toml_text.split("\n"), 1):
        if line.count(".") > _MAX_DOTS:
            raise BadInputError(f"{source}: line {number} has more than {_MAX_DOTS} dots; is it a station file?")
    try:
        document = tomllib.loads(toml_text)
        # By way of JSON: strict there takes arrays and whole numbers for what they are, but no text for a number.
        as_json = json.dumps(document, default=_no_json)
    except ValueError as error:  # TOMLDecodeError, and numbers of thousands of digits
        raise BadInputError(f"{source}: not a valid TOML file: {error}") from error
    except RecursionError as error:
        raise BadInputError(f"{source}: tables or arrays nested too deeply; is it a station file?") from error
    try:
        return StationConfig.model_validate_json(as_json, strict=True)
    except ValidationError as error:
        lines = [f"  {line}" for line in problems_in_words(document, error, StationConfig)]
        raise BadInputError(f"{source}: not a valid station file:\n" + "\n".join(lines)) from error


def load_station(path: Path) -> LoadedStation:
    """Read a station file and the URDF it names (relative to the file).

    Raises:
        BadInputError: A file is missing, too large, not text, or invalid.
    """
    toml_text = _read_text(path, "station file")
    config = parse_station(toml_text, str(path))
    urdf_path = path.parent / config.exoskeleton.urdf
    urdf_text = _read_text(urdf_path, f"URDF named by exoskeleton.urdf in {path}")
    return LoadedStation(config, toml_text, urdf_text, str(path))


def _no_json(value: object) -> list[str]:
    """Return dates and times of day, which no key takes, as something that no key takes for text."""
    return [str(value)]


def _read_text(path: Path, what: str) -> str:
    try:
        facts = path.stat()
        if not stat.S_ISREG(facts.st_mode):  # a device or a pipe has no end
            raise BadInputError(f"{path}: {what} is not a file")
        if facts.st_size > _MAX_BYTES:
            raise BadInputError(f"{path}: {what} is larger than {_MAX_BYTES} bytes; is it the right file?")
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise BadInputError(f"{path}: cannot read the {what}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise BadInputError(f"{path}: {what} is not UTF-8 text (byte {error.start})") from error
