"""The report's section on sensitivity: Tables 3 and 4, Figures 14 to 17, and beyond."""

from pathlib import Path
from typing import Any

from ghest_rt.studies.numbers import number, span_in_words
from ghest_rt.studies.report.accuracy_section import statements_of
from ghest_rt.studies.report.page import BEST, Cell, Section, Table, errors_compared, figures_of

Row = dict[str, Any]

_MUCH = 1.1
"""Figures that differ by less count as alike."""

_BEHIND = "In orange: fused is further off than another one, by more than a tenth."


def sensitivity_section(summary: Row, folder: Path) -> Section:
    """Return the section.

    Args:
        summary: Summary of `study sensitivity`.
        folder: The study's folder.
    """
    largest = summary["at_largest"]
    shifts = [row for row in largest if row["group"] == "shift"]
    further = [row for row in largest if row["group"] != "shift"]
    tables = [_mean_table(summary), _shift_table(shifts)]
    if further:
        tables.append(_further_table(further))
    return Section(
        key="sensitivity",
        title="Sensitivity to markers that move and to wrong calibration",
        paragraphs=(
            "Each marker is really moved in the scene and rendered again, parameter by parameter (Table 3: q1 to q3 move "
            "m0, q4 to q6 move m1), while the calibration stays as it was "
            f"(sensor {summary['sensor']}, {span_in_words(summary['duration_s'])}). "
            "Relative sensitivity S is equation (11): the "
            "share by which the error grows for a share by which the parameter grows.",
        ),
        tables=tuple(tables),
        figures=figures_of(summary, folder),
        statements_title="The paper's statements on sensitivity",
        statements=statements_of(summary),
    )


def _mean_table(summary: Row) -> Table:
    undisturbed = {row["method"]: row for row in summary["undisturbed"]}
    means = summary["mean_at_largest_shift"]
    still = _compared([undisturbed[row["method"]]["orientation_deg_rms"] for row in means])
    displaced = _compared([row["orientation_deg"] for row in means])
    paper_deg = summary["paper"]["mean_orientation_deg_at_20_mm"]
    return Table(
        title="Mean over movements and q1 to q6",
        head=("method", "undisturbed (°)", "marker displaced (°)", "by (mm)", "as published (°)"),
        rows=tuple(
            (
                Cell(row["method"], ""),
                still[k],
                displaced[k],
                Cell(number(row["amount_m"], 1e3)),
                Cell(number(paper_deg) if row["method"] == "paper" else "", "published"),
            )
            for k, row in enumerate(means)
        ),
        note=f"{BEST} of the methods.",
    )


def _compared(values: list[float | None]) -> list[Cell]:
    return errors_compared(values, [number(value) for value in values])


def _shift_table(shifts: list[Row]) -> Table:
    methods = list(dict.fromkeys(row["method"] for row in shifts))
    rows: list[tuple[Cell, ...]] = []
    for parameter in dict.fromkeys(row["parameter"] for row in shifts):
        of = {row["method"]: row for row in shifts if row["parameter"] == parameter}
        first = of[methods[0]]
        cells = [Cell(f"{parameter}: {first['what']} along {first['axis']}, {number(first['amount'], 1e3)} mm", "")]
        for method in methods:
            cells += [
                Cell(number(of[method]["position_m_rms"], 1e3), _kind(of, method, "position_m_rms")),
                Cell(number(of[method]["orientation_deg_rms"]), _kind(of, method, "orientation_deg_rms")),
                Cell(number(of[method]["S_position"])),
                Cell(number(of[method]["S_orientation"])),
            ]
        rows.append(tuple(cells))
    return Table(
        title="Errors and relative sensitivities at the largest translation, mean over movements",
        head=("parameter", *("mm", "°", "S mm", "S °") * len(methods)),
        rows=tuple(rows),
        groups=(("", 1), *((method, 4) for method in methods)),
        note=(
            f"{BEST} of the methods. {_BEHIND} Its S is large and negative where it notices a displacement "
            "only as it grows: the error shrinks there."
        ),
    )


def _further_table(further: list[Row]) -> Table:
    methods = list(dict.fromkeys(row["method"] for row in further))
    rows: list[tuple[Cell, ...]] = []
    for parameter in dict.fromkeys(row["parameter"] for row in further):
        of = {row["method"]: row for row in further if row["parameter"] == parameter}
        first = of[methods[0]]
        amount = f"{first['amount']:g}°" if first["unit"] == "deg" else f"{number(first['amount'], 1e3)} mm"
        rows.append(
            (
                Cell(parameter.replace("_", " "), ""),
                Cell(amount),
                *(Cell(number(of[m]["orientation_deg_rms"]), _kind(of, m, "orientation_deg_rms")) for m in methods),
            )
        )
    return Table(
        title="Beyond the paper: orientation error of the arm (°), mean over movements",
        head=("disturbance", "amount", *methods),
        rows=tuple(rows),
        note=f"{BEST} of the methods. {_BEHIND}",
    )


def _kind(of: dict[str, Row], method: str, column: str) -> str:
    """Return how a method's figure is to look among those of all methods."""
    known = [row[column] for row in of.values() if row[column] is not None]
    value = of[method][column]
    if value is None or len(known) < 2:
        return "number"
    if number(value) == number(min(known)):
        return "best"
    return "behind" if method == "fused" and value > _MUCH * min(known) else "number"
