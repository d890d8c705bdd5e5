"""Where the files of `config/` and `systemd/` are: beside the sources in a checkout, under share/ghest-rt once installed."""

import sys
from pathlib import Path

from ghest_rt.errors import GhestError

_HERE = Path(__file__).resolve()


def shipped_config_dir() -> Path:
    """Return the folder with the station files and URDFs that come with ghest-rt.

    Raises:
        GhestError: The installation lacks them.
    """
    return _shipped("config", "*.toml")


def shipped_systemd_dir() -> Path:
    """Return the folder with the units and rules that come with ghest-rt.

    Raises:
        GhestError: The installation lacks them.
    """
    return _shipped("systemd", "*.service")


def _shipped(name: str, pattern: str) -> Path:
    candidates = (_HERE.parents[2] / name, Path(sys.prefix) / "share" / "ghest-rt" / name)
    for folder in candidates:
        if folder.is_dir() and any(folder.glob(pattern)):
            return folder
    raise GhestError(f"the files of {name}/ are in none of {', '.join(map(str, candidates))}: install ghest-rt again")
