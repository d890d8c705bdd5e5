"""A wall clock that tests turn, for a service process and everything native in it; CLOCK_MONOTONIC stays as it is."""

import shutil
import struct
import subprocess
import time
from pathlib import Path

_SOURCE = Path(__file__).with_suffix(".c")
_LAYOUT = "=qqq"  # offset in ns, slew in parts per billion, CLOCK_MONOTONIC instant that the slew counts from


def compiler() -> str | None:
    """Return a C compiler; without one the wall clock cannot be turned."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


class WallClock:
    """Builds the library in a folder; processes started with `environment` have this wall clock."""

    def __init__(self, folder: Path) -> None:
        found = compiler()
        assert found is not None, "needs a C compiler (apt install gcc libc6-dev)"
        library = folder / "wall_clock.so"
        subprocess.run([found, "-shared", "-fPIC", "-O2", "-o", library, _SOURCE, "-ldl", "-lpthread"], check=True)
        self._control = folder / "wall-clock"
        self._control.write_bytes(struct.pack(_LAYOUT, 0, 0, 0))
        self.environment = {"LD_PRELOAD": str(library), "GHEST_WALL_CLOCK": str(self._control)}

    def turn(self, offset_s: float = 0.0, slew_ppm: float = 0.0) -> None:
        """Step to an offset from the true time, and slew from there on."""
        with self._control.open("r+b", buffering=0) as file:  # in place: the processes have it mapped
            file.write(struct.pack(_LAYOUT, round(offset_s * 1e9), round(slew_ppm * 1e3), time.monotonic_ns()))
