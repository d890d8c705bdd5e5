"""How to get an optional part of the installation: from where the installed one came."""

import importlib.metadata
import json
import shlex
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

_DISTRIBUTION = "ghest-rt"


def pip_install(extra: str = "", *, elsewhere: bool = False) -> str:
    """Return the command that installs ghest-rt, with an extra, as it was installed: from its folder, file or repository.

    Args:
        extra: Name of the extra; may be empty.
        elsewhere: Whether it is for another environment: then it does not go on depending on the folder.
    """
    return f"pip install {requirement(_origin(), extra).removeprefix('-e ' if elsewhere else '')}"


def requirement(origin: dict[str, Any] | None, extra: str) -> str:
    """Return what `pip install` is to be given, quoted for a shell.

    Args:
        origin: The distribution's direct_url.json (PEP 610); None if it has none, hence came from an index.
        extra: Name of the extra; may be empty.
    """
    extras = f"[{extra}]" if extra else ""
    if origin is None:
        return shlex.quote(f"{_DISTRIBUTION}{extras}")
    url = str(origin.get("url", ""))
    if "dir_info" in origin and urlsplit(url).scheme == "file":
        folder = Path(unquote(urlsplit(url).path))
        if not (folder / "pyproject.toml").is_file():
            return f"'/path/to/{_DISTRIBUTION}{extras}'"
        return ("-e " if origin["dir_info"].get("editable") else "") + shlex.quote(f"{folder}{extras}")
    repository = origin.get("vcs_info")
    source = f"{repository['vcs']}+{url}@{repository['commit_id']}" if repository else url
    below = f"#subdirectory={origin['subdirectory']}" if origin.get("subdirectory") else ""
    return shlex.quote(f"{_DISTRIBUTION}{extras} @ {source}{below}")


@cache
def _origin() -> dict[str, Any] | None:
    try:
        text = importlib.metadata.distribution(_DISTRIBUTION).read_text("direct_url.json")
        return None if text is None else dict(json.loads(text))
    except (importlib.metadata.PackageNotFoundError, OSError, ValueError):
        return None
