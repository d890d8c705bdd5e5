"""What the report's page consists of, before it becomes HTML."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ghest_rt.errors import BadInputError
from ghest_rt.studies.numbers import number
from ghest_rt.studies.results import FIGURES


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a table.

    Attributes:
        text: What it says.
        kind: "" for text, "number", "published" for the paper's or a rival's own figure, "best" for the least of those
            compared, "behind" for method `fused` where another one does better.
    """

    text: str
    kind: str = "number"


BEST = "In bold green: the least error"
"""What the colour of `best` cells means; say of what."""


def errors_compared(values: Sequence[float | None], texts: Sequence[str]) -> list[Cell]:
    """Return the cells of errors that are compared with each other; the least are marked, all that look alike."""
    known = [value for value in values if value is not None]
    if len(known) < 2:
        return [Cell(text) for text in texts]
    least = number(min(known))
    return [
        Cell(text, "best" if value is not None and number(value) == least else "number")
        for value, text in zip(values, texts, strict=True)
    ]


@dataclass(frozen=True, slots=True)
class Table:
    """A table.

    Attributes:
        title: Its caption.
        head: Titles of the columns.
        rows: Its cells.
        groups: Titles over several columns, with their spans; may be empty.
        note: What to know about it; may be empty.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    groups: tuple[tuple[str, int], ...] = ()
    note: str = ""


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure, in the page as data.

    Attributes:
        caption: What it shows.
        data_uri: The picture.
        folded: Whether it is shown only on request.
    """

    caption: str
    data_uri: str
    folded: bool = False


@dataclass(frozen=True, slots=True)
class Statement:
    """A statement with its verdict.

    Attributes:
        text: The statement.
        holds: Whether it holds; None where that could not be judged.
        evidence: The figures behind the verdict; every line a paragraph.
        explanation: Why.
    """

    text: str
    holds: bool | None
    evidence: str = ""
    explanation: str = ""


@dataclass(frozen=True, slots=True)
class KeyFigure:
    """A figure worth seeing first.

    Attributes:
        value: With its unit.
        title: What it is.
        beside: What to compare it with.
    """

    value: str
    title: str
    beside: str


@dataclass(frozen=True, slots=True)
class Section:
    """A study.

    Attributes:
        key: Its name on the command line.
        title: Its heading.
        paragraphs: What was done.
        tables: Its tables.
        figures: Its figures.
        statements_title: Heading of the statements.
        statements: What was put to the test.
        badges: The words for a statement that holds, and for one that does not.
        notes: Titled remarks, such as caveats: (title, text).
        missing: Whether the study is not in the results folder.
    """

    key: str
    title: str
    paragraphs: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()
    statements_title: str = "Statements put to the test"
    statements: tuple[Statement, ...] = ()
    badges: tuple[str, str] = ("holds", "does not hold")
    notes: tuple[tuple[str, str], ...] = ()
    missing: bool = False


def figures_of(summary: Mapping[str, Any], folder: Path) -> tuple[Figure, ...]:
    """Return the figures that a study's summary lists, and no others that may lie in its folder.

    Args:
        summary: The summary.
        folder: The study's folder.

    Raises:
        BadInputError: One of them cannot be read.
    """
    return tuple(
        Figure(of["caption"], _data_uri(folder / FIGURES / f"{of['name']}.png"), of["folded"]) for of in summary["figures"]
    )


def _data_uri(path: Path) -> str:
    try:
        return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")
    except OSError as error:
        raise BadInputError(f"{path}: cannot be read: {error.strerror or error}; run the study again") from error
