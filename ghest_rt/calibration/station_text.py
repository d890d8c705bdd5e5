"""A station file's text with new calibration tables; everything else, comments included, stays as it is.

Only the lines of the keys are replaced, so that no TOML writer is needed. What came out is read again and must say exactly what
was meant; a file written in another way than the shipped ones (inline tables, dotted keys) is refused rather than spoilt.
"""

import re
from collections.abc import Mapping

from ghest_rt.config.load import parse_station
from ghest_rt.config.station import Calibration, CalibrationReference, StationConfig
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import Array, nearest_rotation

_HEADER = re.compile(r"^\s*\[\s*([A-Za-z0-9_.\-]+)\s*\]\s*(?:#.*)?$")
_CALIBRATION, _REFERENCE = "calibration", "calibration.reference"
_REMARK = "# Found by `ghest-rt calibrate`"


def rigid_rows(pose: Array) -> tuple[tuple[float, ...], ...]:
    """Return a (4, 4) pose as rows of numbers short enough to be read: 0.1 µm, and rotations that are still rotations."""
    R = nearest_rotation(pose[:3, :3])
    rows = [(*(round(v, 9) + 0.0 for v in R[i].tolist()), round(float(pose[i, 3]), 7) + 0.0) for i in range(3)]
    return (*rows, (0.0, 0.0, 0.0, 1.0))


def with_calibration(toml_text: str, source: str, calibration: Calibration, remark: str) -> str:
    """Return the text with the given calibration.

    Args:
        toml_text: A station file.
        source: Where it came from, for messages.
        calibration: What it shall say; camera mounts must be those that it says already.
        remark: One line of comment on where the numbers come from.

    Raises:
        BadInputError: The file is not written in a way that can be changed here.
    """
    old = parse_station(toml_text, source)
    lines = toml_text.split("\n")
    values = {
        "id": f'"{calibration.id}"',
        "m0_from_gh": _matrix(calibration.m0_from_gh),
        "m1_from_elw": _matrix(calibration.m1_from_elw),
    }
    if calibration.arm_length_m is not None:
        values["arm_length_m"] = repr(calibration.arm_length_m)
    lines = _set([line for line in lines if not line.startswith(_REMARK)], _CALIBRATION, values)
    lines.insert((_section(lines, _CALIBRATION) or (0, 0))[0], f"{_REMARK} {remark}")
    lines = _set(lines, _REFERENCE, _reference(calibration.reference))
    text = "\n".join(lines)
    wanted = old.model_copy(update={"calibration": calibration})
    if not _says(text, source, wanted):
        raise BadInputError(
            f"{source}: its calibration cannot be replaced: write it as the shipped station files do, "
            "with tables [calibration], [calibration.link_from_camera] and one key a line"
        )
    return text


def _reference(reference: CalibrationReference) -> dict[str, str]:
    values = {}
    if reference.elbow_in_link_m is not None:
        values["elbow_in_link_m"] = repr(list(reference.elbow_in_link_m))
    if reference.forearm_twist_deg is not None:
        values["forearm_twist_deg"] = repr(reference.forearm_twist_deg)
    return values


def _says(text: str, source: str, wanted: StationConfig) -> bool:
    try:
        return parse_station(text, source) == wanted
    except BadInputError:
        return False


def _matrix(rows: tuple[tuple[float, ...], ...]) -> str:
    return "[" + ", ".join("[" + ", ".join(map(repr, row)) + "]" for row in rows) + "]"


def _section(lines: list[str], table: str) -> tuple[int, int] | None:
    """Return the lines [start, end) below a table's header up to the next one; None if there is no such table."""
    headers = [(index, match[1]) for index, line in enumerate(lines) if (match := _HEADER.match(line))]
    for place, (index, name) in enumerate(headers):
        if name == table:
            return index + 1, headers[place + 1][0] if place + 1 < len(headers) else len(lines)
    return None


def _set(lines: list[str], table: str, values: Mapping[str, str]) -> list[str]:
    """Return the lines with keys of a table set; new ones come after its last key, a new table after the calibration's last."""
    if not values:
        return lines
    if _section(lines, table) is None:
        place = _end_of_calibration(lines)
        lines = [*lines[:place], "", f"[{table}]", *lines[place:]]
    for key, value in values.items():
        start, end = _section(lines, table) or (0, 0)
        found = next((i for i in range(start, end) if re.match(rf"\s*{key}\s*=", lines[i])), None)
        if found is None:
            place = _after_last_key(lines, start, end)
            lines = [*lines[:place], f"{key} = {value}", *lines[place:]]
        else:
            stop = _end_of_value(lines, found)
            lines = [*lines[:found], f"{key} = {value}{_comment(lines[stop - 1])}", *lines[stop:]]
    return lines


def _end_of_calibration(lines: list[str]) -> int:
    ends = [
        _after_last_key(lines, *section)
        for line in lines
        if (match := _HEADER.match(line))
        and (match[1] == _CALIBRATION or match[1].startswith(_CALIBRATION + "."))
        and (section := _section(lines, match[1]))
    ]
    return max(ends, default=len(lines))


def _after_last_key(lines: list[str], start: int, end: int) -> int:
    place = index = start
    while index < end:
        if re.match(r"\s*[A-Za-z0-9_\-\"]+\s*=", lines[index]):
            index = place = _end_of_value(lines, index)
        else:
            index += 1
    return place


def _end_of_value(lines: list[str], first: int) -> int:
    """Return the line after the value that begins in line `first`: where its brackets are closed."""
    depth = 0
    for index in range(first, len(lines)):
        code = lines[index].split("#", 1)[0]
        depth += code.count("[") - code.count("]")
        if depth <= 0:
            return index + 1
    return len(lines)


def _comment(line: str) -> str:
    before, mark, comment = line.partition("#")
    spaces = len(before) - len(before.rstrip())
    return f"{' ' * max(spaces, 1)}#{comment}" if mark else ""
