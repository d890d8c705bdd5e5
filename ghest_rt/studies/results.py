"""The results folder that studies write and the report reads: for each study a summary, tidy tables and figures."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.extras import need_extra
from ghest_rt.studies.figures.style import ENDINGS, Drawn, save_figure
from ghest_rt.studies.numbers import plain

SUMMARY = "summary.json"
FIGURES = "figures"
_TABLE_ENDINGS = (".csv", ".parquet")

Rows = Sequence[Mapping[str, object]]


def write_study(
    out: Path, document: Mapping[str, object], tables: Mapping[str, Rows], figures: Iterable[Drawn]
) -> dict[str, Any]:
    """Write what a study found into a folder of its name in the results folder, in place of what its last run left there.

    Tables are written as CSV and Parquet, figures in every format. The summary, written last, lists them: what it does not list
    is none of this study's.

    Args:
        out: The results folder.
        document: The summary; `study` is the study's name.
        tables: Rows with the same columns, by the table's name; without rows there is no file.
        figures: The figures.

    Returns:
        The summary as it was written.

    Raises:
        GhestError: The folder cannot be written to, or an extra is not installed.
    """
    folder = out / str(document["study"])
    filled = {name: rows for name, rows in tables.items() if rows}
    listed: list[dict[str, object]] = []
    written = cast(dict[str, Any], plain({**document, "tables": list(filled)})) | {"figures": listed}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _clear(folder)
        for name, rows in filled.items():
            _write_table(rows, folder, name)
        for figure in figures:
            save_figure(figure.picture, folder / FIGURES, figure.name)
            listed.append({"name": figure.name, "caption": figure.caption, "folded": figure.folded})
        part = folder / f".{SUMMARY}"
        part.write_text(json.dumps(written, indent=2, allow_nan=False) + "\n", encoding="utf-8")
        part.replace(folder / SUMMARY)
    except OSError as error:
        raise GhestError(f"{folder}: cannot be written to: {error.strerror or error}") from error
    return written


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


def _clear(folder: Path) -> None:
    """Remove the last run's summary, and the tables and figures that it lists; what else is in the folder stays."""
    try:
        last = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
        tables = [Path(name).name for name in last["tables"]]
        figures = [Path(figure["name"]).name for figure in last["figures"]]
    except (FileNotFoundError, ValueError, LookupError, TypeError):
        tables, figures = [], []
    (folder / SUMMARY).unlink(missing_ok=True)
    for name in tables:
        for ending in _TABLE_ENDINGS:
            (folder / f"{name}{ending}").unlink(missing_ok=True)
    for name in figures:
        for ending in ENDINGS:
            (folder / FIGURES / f"{name}{ending}").unlink(missing_ok=True)


def _write_table(rows: Rows, folder: Path, name: str) -> None:
    need_extra("study", "a table of results")
    import pyarrow as pa  # noqa: PLC0415 - an extra, imported only when used
    from pyarrow import csv, parquet  # noqa: PLC0415

    table = pa.Table.from_pylist(cast(list[dict[str, object]], plain(list(rows))))
    csv.write_csv(table, folder / f"{name}.csv")
    parquet.write_table(table, folder / f"{name}.parquet")
