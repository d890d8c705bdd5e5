"""Which device misbehaves how, and when: a file that all fixture processes look at."""

import json
import os
from dataclasses import dataclass
from pathlib import Path

FILE = "faults.json"
FOLDER_VARIABLE = "GHEST_HIL_FOLDER"


def hil_folder() -> Path:
    """Return the folder of this run, in a fixture process."""
    return Path(os.environ[FOLDER_VARIABLE])


@dataclass(frozen=True, slots=True)
class Window:
    """A fault of one device from one instant of the monotonic clock to another."""

    devices: tuple[str, ...]
    fault: str
    from_ns: int
    until_ns: int


def inject(folder: Path, window: Window) -> None:
    """Announce a fault; takes the place of the one before."""
    text = json.dumps({"devices": window.devices, "fault": window.fault, "from": window.from_ns, "until": window.until_ns})
    new = folder / f"{FILE}.new"
    new.write_text(text)
    new.replace(folder / FILE)


SLEW = 500e-6  # the fastest that NTP turns a clock
STEP_NS = 7_000_000_000


class DeviceClock:
    """What faults do to a device's own clock: a step that ends with the fault, or a slew whose offset stays."""

    def __init__(self, injected: "Injected") -> None:
        self._injected = injected
        self._slewed_ns = 0.0
        self._last_ns: int | None = None

    def off_ns(self, t_ns: int) -> int:
        """Return by how much the clock is off at an instant; ask for rising instants."""
        fault = self._injected.fault(t_ns)
        if fault == "clock_slew" and self._last_ns is not None:
            self._slewed_ns += SLEW * (t_ns - self._last_ns)
        self._last_ns = t_ns
        return round(self._slewed_ns) + (STEP_NS if fault == "clock_step" else 0)


class Injected:
    """What is to be done now, for a fixture that asks before every sample."""

    def __init__(self, folder: Path, device: str) -> None:
        self._path = folder / FILE
        self._device = device
        self._seen_ns = -1
        self._window = Window((), "", 0, 0)

    def fault(self, now_ns: int) -> str:
        """Return the fault to show at this instant; "" for none."""
        try:
            changed_ns = self._path.stat().st_mtime_ns
            if changed_ns != self._seen_ns:
                self._seen_ns = changed_ns
                found = json.loads(self._path.read_text())
                self._window = Window(tuple(found["devices"]), found["fault"], found["from"], found["until"])
        except FileNotFoundError:
            return ""
        window = self._window
        return window.fault if self._device in window.devices and window.from_ns <= now_ns < window.until_ns else ""
