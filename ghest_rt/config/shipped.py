"""Where the files of `config/` are: beside the sources in a checkout, under share/ghest-rt in an installation."""

import sys
from pathlib import Path

from ghest_rt.errors import GhestError

_HERE = Path(__file__).resolve()


def shipped_config_dir() -> Path:
    """Return the folder with the station files and URDFs that come with ghest-rt.

    Raises:
        GhestError: The installation lacks them.
    """
    candidates = (_HERE.parents[2] / "config", Path(sys.prefix) / "share" / "ghest-rt" / "config")
    for folder in candidates:
        if folder.is_dir() and any(folder.glob("*.toml")):
            return folder
    raise GhestError(f"the files of config/ are in none of {', '.join(map(str, candidates))}: install ghest-rt again")
