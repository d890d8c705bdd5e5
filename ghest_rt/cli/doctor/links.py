"""Serial ports and CAN interfaces."""

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_PORT_PATTERNS = ("serial/by-id/*", "ttyUSB*", "ttyACM*")
_ARPHRD_CAN = "280"
_IFF_UP = 1


@dataclass(frozen=True, slots=True)
class SerialPort:
    """A serial port.

    Attributes:
        path: Its device file.
        permitted: Whether this user may open it.
    """

    path: str
    permitted: bool


@dataclass(frozen=True, slots=True)
class CanInterface:
    """A CAN interface of the kernel.

    Attributes:
        name: Its name ("can0").
        is_up: Whether it is switched on.
    """

    name: str
    is_up: bool


def serial_ports(dev: Path = Path("/dev")) -> Iterator[SerialPort]:
    """Yield the ports of USB converters, those with lasting names first."""
    for pattern in _PORT_PATTERNS:
        for path in sorted(dev.glob(pattern)):
            yield SerialPort(str(path), may_open(path))


def may_open(path: Path) -> bool:
    """Return whether this user may read and write a device file."""
    return os.access(path, os.R_OK | os.W_OK)


def is_serial(path: Path, sys_char: Path = Path("/sys/dev/char")) -> bool:
    """Return whether a device file may be a serial port; told without opening it, which would reset some boxes.

    Where the kernel does not say of what kind a character device is (pseudo-terminals), it may be one.
    """
    facts = path.stat()
    if not stat.S_ISCHR(facts.st_mode):
        return False
    subsystem = sys_char / f"{os.major(facts.st_rdev)}:{os.minor(facts.st_rdev)}" / "subsystem"
    return not subsystem.exists() or subsystem.resolve().name == "tty"


def can_interfaces(root: Path = Path("/sys/class/net")) -> Iterator[CanInterface]:
    """Yield the CAN interfaces of the kernel."""
    for folder in sorted(root.glob("*")):
        try:
            if (folder / "type").read_text().strip() == _ARPHRD_CAN:
                yield CanInterface(folder.name, bool(int((folder / "flags").read_text(), 16) & _IFF_UP))
        except (OSError, ValueError):
            continue
