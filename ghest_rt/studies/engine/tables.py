"""Results as files: tidy tables, one row per finding, as CSV and Parquet; summaries as JSON."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from ghest_rt.errors import GhestError
from ghest_rt.extras import need_extra


def finite(value: float) -> float | None:
    """Return a number as JSON can hold it: None if it is not finite."""
    return float(value) if math.isfinite(value) else None


def write_summary(document: Mapping[str, object], folder: Path) -> Path:
    """Write a document to `<folder>/summary.json`; return the path.

    Raises:
        GhestError: The folder cannot be written to.
    """
    path = folder / "summary.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(document, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    except OSError as error:
        raise GhestError(f"{folder}: cannot be written to: {error.strerror or error}") from error
    return path


def write_tables(rows: Sequence[Mapping[str, object]], folder: Path, name: str) -> tuple[Path, Path]:
    """Write rows with the same columns to `<folder>/<name>.csv` and `.parquet`; return both paths.

    Raises:
        GhestError: PyArrow is not installed, or the folder cannot be written to.
    """
    need_extra("study", "a table of results")
    import pyarrow as pa  # noqa: PLC0415 - an extra, imported only when used
    from pyarrow import csv, parquet  # noqa: PLC0415

    table = pa.Table.from_pylist([dict(row) for row in rows])
    paths = folder / f"{name}.csv", folder / f"{name}.parquet"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        csv.write_csv(table, paths[0])
        parquet.write_table(table, paths[1])
    except OSError as error:
        raise GhestError(f"{folder}: cannot be written to: {error.strerror or error}") from error
    return paths
