"""Asks a vendor's library which devices it sees, in a process of its own: it may be missing, slow, or crash.

`python -m ghest_drivers.hardware.probe realsense` prints one JSON document, on the last line of its standard output.
"""

import importlib
import json
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from ghest_drivers.errors import DriverError

Family = Literal["realsense", "oak"]
_FAMILIES: tuple[Family, ...] = ("realsense", "oak")


@dataclass(frozen=True, slots=True)
class ProbeResult:
    """What a library sees.

    Attributes:
        devices: One mapping per device: the fields of `RealsenseDevice` or `OakDevice`.
        problem: Why the library could not be asked, or None.
    """

    devices: tuple[Mapping[str, str], ...]
    problem: str | None = None


def probe(family: Family, timeout_s: float = 10.0) -> ProbeResult:
    """Return what the library of a family of cameras sees now."""
    command = [sys.executable, "-m", __name__, family]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)  # noqa: S603 - our own interpreter and module
    except subprocess.TimeoutExpired:
        return ProbeResult((), f"its library did not answer within {timeout_s:g} s: unplug the cameras and plug them in again")
    lines = done.stdout.strip().splitlines()
    try:
        answer = json.loads(lines[-1])
    except (IndexError, ValueError):
        return ProbeResult((), f"its library ended the process that asked it (exit code {done.returncode})")
    return ProbeResult(tuple(answer["devices"]), answer["problem"])


def _ask(family: str) -> dict[str, Any]:
    if family not in _FAMILIES:
        return {"devices": [], "problem": f"no family of cameras {family!r}"}
    try:
        devices: Any = importlib.import_module(f"ghest_drivers.hardware.{family}.devices")
        return {"devices": [asdict(device) for device in devices.list_devices()], "problem": None}
    except (DriverError, RuntimeError) as error:
        return {"devices": [], "problem": str(error)}


if __name__ == "__main__":
    sys.stdout.write("\n" + json.dumps(_ask(sys.argv[1])) + "\n")
