"""The report's section on accuracy: Tables 5 and 6, Figure 13, the paper's values beside."""

from pathlib import Path
from typing import Any

from ghest_rt.studies.numbers import number, percent, span_in_words
from ghest_rt.studies.report.page import BEST, Cell, Section, Statement, Table, errors_compared, figures_of

Row = dict[str, Any]

_POSITIONS = (("m0_m", "marker m0 (mm)", 1e3), ("m1_m", "marker m1 (mm)", 1e3))
_ARM = (("position_m", "arm, position (mm)", 1e3), ("orientation_deg", "arm, orientation (°)", 1.0))


def accuracy_section(summary: Row, folder: Path) -> Section:
    """Return the section.

    Args:
        summary: Summary of `study accuracy`.
        folder: The study's folder.
    """
    entries = summary["table"]
    sensors = list(dict.fromkeys(entry["sensor"] for entry in entries))
    tables: list[Table] = []
    for sensor in sensors:
        for title, quantities in (("Table 5: position of the markers", _POSITIONS), ("Table 6: pose of the upper arm", _ARM)):
            tables.append(_table(entries, sensor, title, quantities))
    return Section(
        key="accuracy",
        title="Accuracy",
        paragraphs=(
            "Errors of the estimated against the true pose, by the paper's metrics (3.4.2): distance for positions, norm "
            "of the exponential map of the rotation between them for orientations. Root mean square over each movement "
            f"({span_in_words(summary['duration_s'])}), "
            f"mean over {len(summary['seeds'])} seeds; ± is half the 95 % confidence interval of that mean. In italics "
            "what the paper reports. Valid is the share of the samples with that status; errors are of all samples that have "
            "angles, degraded ones too.",
        ),
        tables=tuple(tables),
        figures=figures_of(summary, folder),
        statements_title="The paper's statements on accuracy",
        statements=statements_of(summary),
    )


def statements_of(summary: Row) -> tuple[Statement, ...]:
    """Return a summary's checks as statements."""
    return tuple(Statement(c["name"], c["holds"], c["evidence"], c["explanation"]) for c in summary.get("checks", ()))


def _table(entries: list[Row], sensor: str, title: str, quantities: tuple[tuple[str, str, float], ...]) -> Table:
    here = [entry for entry in entries if entry["sensor"] == sensor]
    methods = list(dict.fromkeys(entry["method"] for entry in here))
    published = any(entry["paper_rms"] is not None for entry in here)
    rows: list[tuple[Cell, ...]] = []
    for movement in dict.fromkeys(entry["movement"] for entry in here):
        cells = [Cell(movement, "")]
        for quantity, _, scale in quantities:
            found = {e["method"]: e for e in here if (e["movement"], e["quantity"]) == (movement, quantity)}
            if published:
                cells.append(Cell(number(next(iter(found.values()))["paper_rms"], scale), "published"))
            errors = [found[m]["rms"] if found[m]["rms"] is None else scale * found[m]["rms"] for m in methods]
            cells += errors_compared(errors, [_with_interval(found[m], scale) for m in methods])
        rows.append(tuple(cells))
        valid = {e["method"]: e["valid_fraction"] for e in here if e["movement"] == movement}
        rows[-1] += (Cell(", ".join(percent(valid[m]) for m in methods)),)
    columns = (("as published",) if published else ()) + tuple(methods)
    return Table(
        title=f"{title}, sensor {sensor}",
        head=("movement", *columns * len(quantities), ", ".join(methods)),
        rows=tuple(rows),
        groups=(("", 1), *((name, len(columns)) for _, name, _ in quantities), ("valid (%)", 1)),
        note=f"{BEST} of the methods here, each judged at the instant that its answer holds for.",
    )


def _with_interval(entry: Row, scale: float) -> str:
    text = number(entry["rms"], scale)
    if entry["rms_low"] is None:
        return text
    return f"{text} ± {number((entry['rms_high'] - entry['rms_low']) / 2, scale)}"
