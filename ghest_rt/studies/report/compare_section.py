"""The report's section on the comparison: Table 7 made real."""

from pathlib import Path
from statistics import fmean
from typing import Any

from ghest_rt.studies.compare.verdicts import tally
from ghest_rt.studies.numbers import number, percent, span_in_words
from ghest_rt.studies.report.page import BEST, Cell, Section, Statement, Table, errors_compared, figures_of

Row = dict[str, Any]

_KINDS = {"therapy": "the movements of Table 2", "recorded": "recorded movements of people"}
_COLUMNS = (
    ("orientation_deg", "GH rotation"),
    ("published_deg", "when published"),
    ("flexion_deg", "flexion"),
    ("abduction_deg", "abduction"),
    ("rotation_deg", "rotation"),
)


def compare_section(summary: Row, folder: Path) -> Section:
    """Return the section.

    Args:
        summary: Summary of `study compare`.
        folder: The study's folder.
    """
    contenders = summary["contenders"]
    groups = [(group["sensor"], group["kind"]) for group in contenders[0]["measured"]]
    tables = [_table(summary, sensor, kind) for sensor, kind in groups]
    tables += [_by_movement(summary, sensor) for sensor in summary["settings"]["sensors"]]
    return Section(
        key="compare",
        title="Comparison with other ways (Table 7)",
        paragraphs=(
            "Every contender estimates the same simulated sessions, through the same interface. Rivals are calibrated in "
            "the neutral posture and told the patient's dimensions exactly (the inertial sensors: their true attitudes at"
            " the start); nobody sees the truth after that. Errors are root mean squares over a movement, then means over"
            " movements and seeds; degrees. “When published” is judged by where the arm is at the instant at which the "
            "answer is published, all other columns at the instant for which it is meant. Errors are of the instants at which "
            "a contender answers; whether fused wins is judged where both do, and it wins no row where it answers less often. "
            f"Played: {span_in_words(summary['settings']['duration_s'])}.",
        ),
        tables=tuple(tables),
        figures=figures_of(summary, folder),
        statements_title="Does fused win?",
        statements=_statements(summary),
        badges=("always", "not always"),
        notes=tuple((who["title"], _note(who, summary)) for who in contenders if not who["ours"]),
    )


def _note(who: Row, summary: Row) -> str:
    text = f"After {who['source']}. Its own publication: {who['published']}. To bear in mind: {who['caveat']}."
    if who["key"] == "inertial":
        rest = summary["inertial_after_rest"]
        text += f" Measured here: after holding still for {rest['rest_s']:.0f} s it is off by {number(rest['error_deg'])}° "
        text += f"(mean of {rest['sessions']} sessions, {number(rest['least_deg'])}° to {number(rest['most_deg'])}°)."
    return text


def _table(summary: Row, sensor: str, kind: str) -> Table:
    rows: list[tuple[Cell, ...]] = []
    all_measured = [
        next(g for g in who["measured"] if (g["sensor"], g["kind"]) == (sensor, kind)) for who in summary["contenders"]
    ]
    columns = [_column([measured[name] for measured in all_measured]) for name, _ in _COLUMNS]
    for k, (who, measured) in enumerate(zip(summary["contenders"], all_measured, strict=True)):
        won = tally(summary["verdicts"], who["key"], sensor, kind)
        rows.append(
            (
                Cell(who["title"], ""),
                *(column[k] for column in columns),
                Cell(percent(measured["answered_fraction"])),
                Cell(f"{won.own_instant} of {won.rows}" if won.rows else ""),
                Cell(f"{won.published} of {won.rows}" if won.rows else ""),
                Cell(who["published_short"], "published wide"),
            )
        )
    turned, held, straight = (
        ", ".join(f"{name} {number(deg)}°" for name, deg in _movements(summary, sensor, kind, column).items())
        for column in ("girdle_turn_deg", "hold_forecast_deg", "straight_forecast_deg")
    )
    return Table(
        title=f"Mean over {_KINDS[kind]}, sensor {sensor}: errors (°)",
        head=(
            "contender",
            *(title for _, title in _COLUMNS),
            "answered (%)",
            "fused wins",
            "… when published",
            "its own publication",
        ),
        rows=tuple(rows),
        note=(
            f"{BEST} of each column. The scapula turned by (RMS against the neutral posture, unseen by any encoder): {turned}. "
            f"How much there is to foresee: keeping the exact truth of one image ago is off by {held}; continuing it straight "
            f"by {straight} (RMS)."
        ),
    )


def _movements(summary: Row, sensor: str, kind: str, column: str) -> dict[str, float]:
    """Return the movements of a kind and what a column says of each, mean over the seeds."""
    said: dict[str, list[float]] = {}
    for row in summary["rows"]:
        if (row["sensor"], row["kind"]) == (sensor, kind):
            said.setdefault(row["movement"], []).append(row[column])
    return {movement: fmean(values) for movement, values in said.items()}


def _by_movement(summary: Row, sensor: str) -> Table:
    movements = list(dict.fromkeys(row["movement"] for row in summary["rows"] if row["sensor"] == sensor))
    columns = [
        _column([_mean_of(summary, sensor, who["key"], movement) for who in summary["contenders"]]) for movement in movements
    ]
    rows = [(Cell(who["title"], ""), *(column[k] for column in columns)) for k, who in enumerate(summary["contenders"])]
    return Table(
        title=f"GH rotation by movement, sensor {sensor}: errors (°)",
        head=("contender", *movements),
        rows=tuple(rows),
        note=f"{BEST} of each column.",
    )


def _mean_of(summary: Row, sensor: str, contender: str, movement: str) -> float | None:
    values = [
        row["orientation_deg"]
        for row in summary["rows"]
        if (row["sensor"], row["contender"], row["movement"]) == (sensor, contender, movement)
        and row["orientation_deg"] is not None
    ]
    return fmean(values) if values else None


def _column(values: list[float | None]) -> list[Cell]:
    return errors_compared(values, [number(value) for value in values])


def _statements(summary: Row) -> tuple[Statement, ...]:
    titles = {who["key"]: who["title"] for who in summary["contenders"]}
    statements: list[Statement] = []
    for key, title in titles.items():
        mine = [v for v in summary["verdicts"] if v["contender"] == key]
        if not mine:
            continue
        won = [v for v in mine if v["fused_wins"]]
        evidence = "\n".join(f"{v['movement']} ({v['sensor']}): {v['verdict']}" for v in mine if not v["fused_wins"])
        statements.append(Statement(f"against {title}: in {len(won)} of {len(mine)} rows", len(won) == len(mine), evidence))
    return tuple(statements)
