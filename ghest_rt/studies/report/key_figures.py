"""The figures that the report begins with."""

from collections.abc import Collection, Mapping
from typing import Any

from ghest_rt.studies.movements import MEAN_OF_MOVEMENTS
from ghest_rt.studies.numbers import number, span_in_words
from ghest_rt.studies.paper_values import MEAN, MEAN_RMSE_20_MM_DEG
from ghest_rt.studies.report.page import KeyFigure

Row = dict[str, Any]


def key_figures(summaries: Mapping[str, Row]) -> list[KeyFigure]:
    """Return what the summaries have to say first, each with the figure to compare it with."""
    figures: list[KeyFigure] = []
    if "accuracy" in summaries:
        figures += _accuracy(summaries["accuracy"])
    if "sensitivity" in summaries:
        figures += _sensitivity(summaries["sensitivity"])
    if "latency" in summaries:
        figures += _latency(summaries["latency"])
    if "compare" in summaries:
        figures += _compare(summaries["compare"])
    return figures


def _accuracy(summary: Row) -> list[KeyFigure]:
    found = {
        entry["method"]: entry["rms"]
        for entry in summary["table"]
        if (entry["sensor"], entry["quantity"], entry["movement"]) == ("paper", "orientation_deg", MEAN_OF_MOVEMENTS)
    }
    if "fused" not in found:
        return []
    ours = f", the same method here {number(found['paper'])}°" if "paper" in found else ""
    return [
        KeyFigure(
            f"{number(found['fused'])}°",
            "orientation of the arm, fused",
            f"the paper reports {number(MEAN['orientation_deg'])}°{ours}; RMS, mean of the movements, "
            f"{span_in_words(summary['duration_s'])}",
        )
    ]


def _sensitivity(summary: Row) -> list[KeyFigure]:
    found = {row["method"]: row for row in summary["mean_at_largest_shift"]}
    if "fused" not in found:
        return []
    shift = number(found["fused"]["amount_m"], 1e3)
    ours = f"; the same method here {number(found['paper']['orientation_deg'])}°" if "paper" in found else ""
    return [
        KeyFigure(
            f"{number(found['fused']['orientation_deg'])}°",
            f"with a marker displaced by {shift} mm, fused",
            f"the paper reports {number(MEAN_RMSE_20_MM_DEG)}° at 20 mm{ours}; {span_in_words(summary['duration_s'])}",
        )
    ]


def _latency(summary: Row) -> list[KeyFigure]:
    found = {who["key"]: who for who in summary["candidates"]}
    return [
        KeyFigure(
            f"{number(found['fused']['effective_delay_ms'])} ms",
            "behind the arm, fused",
            f"paper with its latest frames {number(found['paper_at_once']['effective_delay_ms'])} ms, "
            f"refined {number(found['refined']['effective_delay_ms'])} ms",
        )
    ]


def _compare(summary: Row) -> list[KeyFigure]:
    def won(keys: Collection[str]) -> str:
        rows = [verdict for verdict in summary["verdicts"] if verdict["contender"] in keys]
        return f"{sum(verdict['fused_wins'] for verdict in rows)} of {len(rows)}"

    contenders = summary["contenders"]
    own = [f"{who['title']} {won([who['key']])}" for who in contenders if who["ours"] and who["key"] != "fused"]
    beside = "in the rotation and in every single angle; what is not won is explained"
    return [
        KeyFigure(
            won([who["key"] for who in contenders if not who["ours"]]),
            "rows against other ways won by fused",
            beside + (f". Against the other methods here: {', '.join(own)}" if own else ""),
        )
    ]
