"""The results folder that studies write and the report reads: a JSON summary and tidy tables per study."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.studies.engine.tables import write_tables


def write_results(folder: Path, name: str, summary: Mapping[str, object], rows: Sequence[Mapping[str, object]]) -> list[Path]:
    """Write `<name>.json`, and the rows as `<name>.csv` and `<name>.parquet`; return the paths.

    Raises:
        GhestError: The folder cannot be written to, or PyArrow is not installed.
    """
    paths = write_tables(rows, folder, name)
    text = json.dumps(plain(summary), indent=2, allow_nan=False) + "\n"
    try:
        (folder / f"{name}.json").write_text(text, encoding="utf-8")
    except OSError as error:
        raise GhestError(f"{folder}: cannot be written to: {error.strerror or error}") from error
    return [folder / f"{name}.json", *paths]


def read_summary(folder: Path, name: str) -> dict[str, Any] | None:
    """Return a study's summary, or None if it is not in the folder.

    Raises:
        BadInputError: The file is no summary.
    """
    path = folder / f"{name}.json"
    if not path.is_file():
        return None
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path}: is no summary of a study: {error}; run `ghest-rt study {name}` again") from error
    if not isinstance(found, dict):
        raise BadInputError(f"{path}: is no summary of a study; run `ghest-rt study {name}` again")
    return found


def plain(value: object) -> object:
    """Return a value as JSON takes it; what is not finite becomes None."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    return value
