"""What systemd says of units, a second station to install, and what an installation leaves."""

import shutil
import subprocess
from pathlib import Path

from tests.systemd.conftest import STATION

TARGETS = Path("/usr/lib/systemd/system")


def analyze(*arguments: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(["systemd-analyze", *map(str, arguments)], capture_output=True, text=True, timeout=60, check=False)


def other_station(folder: Path) -> Path:
    """Return a second station that gets along with the first."""
    folder.mkdir()
    text = STATION.read_text().replace('id = "sim"', 'id = "bed-2"')
    (folder / "station.toml").write_text(f'{text}\n[publisher]\nlisten = ["tcp/127.0.0.1:7448"]\n')
    shutil.copy(STATION.parent / "armeo_spring.urdf", folder)
    return folder / "station.toml"


def files_in(root: Path) -> set[str]:
    """Return the files of the installation; what sysusers leaves (users) is not one."""
    names = {str(path.relative_to(root)) for path in root.rglob("*") if path.is_symlink() or path.is_file()}
    return {name for name in names if "ghest-rt" in name and not name.startswith("opt/")}
