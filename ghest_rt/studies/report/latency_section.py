"""The report's section on latency."""

from pathlib import Path
from typing import Any

from ghest_rt.studies.numbers import number
from ghest_rt.studies.report.page import BEST, Cell, Section, Table, errors_compared, figures_of

Row = dict[str, Any]


def latency_section(summary: Row, folder: Path) -> Section:
    """Return the section.

    Args:
        summary: Summary of `study latency`.
        folder: The study's folder.
    """
    return Section(
        key="latency",
        title="Latency and prediction",
        paragraphs=(
            f"Movements played slower and faster ({summary['settings']['span_s']:g} s of each, in its own time), every answer "
            "judged by where the arm is at the instant at which it is published. A method that waits for its inputs is behind "
            "by its lag; fused forecasts to the instant of publishing. “Behind the arm” is the slope of error against angular "
            "speed.",
        ),
        tables=(_candidates(summary), _speeds(summary)),
        figures=figures_of(summary, folder),
    )


def _candidates(summary: Row) -> Table:
    behind, errors = (
        _compared([who[name] for who in summary["candidates"]]) for name in ("effective_delay_ms", "published_deg")
    )
    return Table(
        title="Answers when they are published",
        note=(
            "Computing: median on the machine that ran the study; it adds to the age of the image. "
            "In bold green: the least delay and the least error."
        ),
        head=(
            "method",
            "lag (ms)",
            "newest image used (ms old)",
            "computing: image, answer (ms)",
            "behind the arm (ms)",
            "error (° RMS)",
        ),
        rows=tuple(
            (
                Cell(who["title"], ""),
                Cell(f"{who['lag_ms']:.0f}"),
                Cell(number(max(who["age_ms"][camera] or 0.0 for camera in ("r0", "r1")))),
                Cell(f"{number(who['vision_ms'])}, {number(who['answer_ms'])}"),
                behind[k],
                errors[k],
            )
            for k, who in enumerate(summary["candidates"])
        ),
    )


def _speeds(summary: Row) -> Table:
    keys = {who["key"]: who["title"] for who in summary["candidates"]}
    rows: list[tuple[Cell, ...]] = []
    for movement, speed in dict.fromkeys((row["movement"], row["speed"]) for row in summary["rows"]):
        there = {r["candidate"]: r for r in summary["rows"] if (r["movement"], r["speed"]) == (movement, speed)}
        rows.append(
            (
                Cell(movement, ""),
                Cell(f"×{speed:g}"),
                Cell(number(there["fused"]["rms_speed_dps"])),
                *_compared([there[key]["published_deg"] for key in keys]),
            )
        )
    return Table(
        title=f"Error when published (° RMS), sensor {summary['settings']['sensor']}",
        head=("movement", "speed", "GH joint (°/s RMS)", *keys.values()),
        rows=tuple(rows),
        note=f"{BEST} of each row.",
    )


def _compared(values: list[float | None]) -> list[Cell]:
    return errors_compared(values, [number(value) for value in values])
