"""Read OpenSim motion files (.mot, .sto): a header, `endheader`, column names, rows of numbers."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import Array

_MAX_BYTES = 200_000_000
_MIN_ROWS = 4


@dataclass(frozen=True, slots=True, eq=False)
class MotionTable:
    """A motion file's content.

    Attributes:
        source: File name, for messages.
        in_degrees: Whether rotations are in degrees.
        columns: (rows,) float64 each, by name, without `time`.
        t_s: (rows,) increasing times.
    """

    source: str
    in_degrees: bool
    columns: dict[str, Array]
    t_s: Array


def read_motion_table(path: Path) -> MotionTable:
    """Read a motion file.

    Raises:
        BadInputError: Missing, not text, without header or column names, a row of the wrong length, something that is not a
            finite number, or times that do not increase; names file and line.
    """
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise BadInputError(f"{path}: larger than {_MAX_BYTES} bytes; is it a motion file?")
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise BadInputError(f"{path}: cannot read the motion file: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise BadInputError(f"{path}: not a text file (byte {error.start}); give an OpenSim .mot file") from error
    end = next((k for k, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None:
        raise BadInputError(f"{path}: no line `endheader`; give an OpenSim .mot file, or export the motion again")
    header = _header(lines[:end])
    in_degrees = header.get("indegrees", "yes").lower() == "yes"
    names_at = next((k for k in range(end + 1, len(lines)) if lines[k].strip()), None)
    if names_at is None:
        raise BadInputError(f"{path}, line {end + 2}: no column names after `endheader`; export the motion again")
    names = lines[names_at].split()
    if names[0] != "time" or len(set(names)) != len(names):
        raise BadInputError(f"{path}, line {names_at + 1}: the first column must be `time` and no name may occur twice")
    values = _rows(path, lines, names_at + 1, len(names))
    declared = header.get("nrows")
    if declared is not None and declared.isdigit() and int(declared) != len(values):
        raise BadInputError(
            f"{path}: the header says nRows={declared} but there are {len(values)} rows; the file is cut or edited"
        )
    t = values[:, 0]
    backwards = np.flatnonzero(np.diff(t) <= 0)
    if len(backwards):
        raise BadInputError(f"{path}: time does not increase after {t[backwards[0]]:g} s; remove the repeated row")
    return MotionTable(str(path), in_degrees, {name: values[:, k] for k, name in enumerate(names) if k}, t)


def _header(lines: list[str]) -> dict[str, str]:
    pairs = (line.partition("=") for line in lines)
    return {key.strip().lower(): value.strip() for key, equals, value in pairs if equals}


def _rows(path: Path, lines: list[str], first: int, width: int) -> Array:
    rows = []
    for number, line in enumerate(lines[first:], first + 1):
        if not line.strip():
            continue
        words = line.split()
        if len(words) != width:
            raise BadInputError(f"{path}, line {number}: {len(words)} values for {width} columns; is the file cut?")
        try:
            row = [float(word) for word in words]
        except ValueError as error:
            raise BadInputError(f"{path}, line {number}: {error}; only numbers may stand here") from error
        if not np.isfinite(row).all():
            raise BadInputError(f"{path}, line {number}: a value is not finite; fill the gap before the motion is used")
        rows.append(row)
    if len(rows) < _MIN_ROWS:
        raise BadInputError(f"{path}: only {len(rows)} rows; a motion needs at least {_MIN_ROWS}")
    return np.array(rows)
