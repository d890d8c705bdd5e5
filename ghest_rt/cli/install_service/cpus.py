"""The CPUs that a service is kept to."""

import re
from pathlib import Path

from ghest_rt.errors import BadInputError

_CPUS = re.compile(r"[0-9]{1,5}(-[0-9]{1,5})?(,[0-9]{1,5}(-[0-9]{1,5})?)*")
_CPUS_PRESENT = Path("/sys/devices/system/cpu/present")


def check_cpus(cpus: str, must_exist: bool) -> None:
    """Refuse a list of CPUs that is none, or names some that the machine lacks.

    Args:
        cpus: Like "2-3" or "0,2-3".
        must_exist: Whether it is for this machine.

    Raises:
        BadInputError: It cannot be used.
    """
    if not _CPUS.fullmatch(cpus) or any(first > last for first, last in _ranges(cpus)):
        raise BadInputError(f"--cpus {cpus!r}: write CPUs as 2-3 or 2,3")
    present = _CPUS_PRESENT.read_text(encoding="ascii").strip() if _CPUS_PRESENT.is_file() else ""
    if not must_exist or not _CPUS.fullmatch(present):
        return
    exist = {number for first, last in _ranges(present) for number in range(first, last + 1)}
    if any(not exist.issuperset((first, last)) for first, last in _ranges(cpus)):
        raise BadInputError(f"--cpus {cpus}: this machine has the CPUs {present}; name some of these")


def _ranges(cpus: str) -> list[tuple[int, int]]:
    """Return the first and last CPU of each part of a list like "0,2-3"."""
    parts = [part.partition("-") for part in cpus.split(",")]
    return [(int(first), int(last or first)) for first, _, last in parts]
