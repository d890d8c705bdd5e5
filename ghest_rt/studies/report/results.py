"""The results folder that studies write and the report reads: a summary and tidy tables, a folder for each study."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ghest_rt.errors import BadInputError
from ghest_rt.studies.engine.tables import write_summary, write_tables

SUMMARY = "summary.json"


def write_results(
    folder: Path, name: str, summary: Mapping[str, object], rows: Sequence[Mapping[str, object]]
) -> dict[str, Any]:
    """Write a study's summary and rows into a folder of its name in the results folder; return the summary as it was written.

    Raises:
        GhestError: The folder cannot be written to, or PyArrow is not installed.
    """
    document = {key: plain(value) for key, value in summary.items()}
    write_summary(document, folder / name)
    write_tables(rows, folder / name, "rows")
    return document


def read_summary(folder: Path, name: str) -> dict[str, Any] | None:
    """Return a study's summary, or None if it is not in the results folder.

    Raises:
        BadInputError: The file is no summary.
    """
    path = folder / name / SUMMARY
    if not path.is_file():
        return None
    remedy = f"run `ghest-rt study {name}` again"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path}: is no summary of a study: {error}; {remedy}") from error
    if not isinstance(found, dict):
        raise BadInputError(f"{path}: is no summary of a study; {remedy}")
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
