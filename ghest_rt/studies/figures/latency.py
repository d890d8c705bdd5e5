"""The figure of the latency study: error when published against the speed of the GH joint."""

import textwrap
from collections.abc import Iterator
from typing import Any

from ghest_rt.studies.figures.style import METHOD_COLORS, Drawn, new_figure

_COLORS = {**METHOD_COLORS, "paper_at_once": "#E69F00"}
_SYMBOLS = {"paper": "s", "paper_at_once": "v", "refined": "o", "fused": "D"}


def figures(summary: dict[str, Any]) -> Iterator[Drawn]:
    """Draw the study's figure.

    Args:
        summary: Summary of `study latency`.
    """
    settings = summary["settings"]
    speeds = ", ".join(f"×{speed:g}" for speed in settings["speeds"])
    caption = (
        f"Error when published against the speed of the GH joint: sensor {settings['sensor']}, "
        f"{', '.join(settings['movements'])}, {settings['span_s']:g} s of each at {speeds}"
    )
    yield Drawn("latency", caption, draw_latency(summary))


def draw_latency(summary: dict[str, Any]) -> Any:
    """Return the median error with its 5 to 95 % band by angular speed, and how far behind the arm each candidate is.

    Args:
        summary: Summary of `study latency`.
    """
    figure = new_figure(7.2, 3.4)
    left, right = figure.subplots(1, 2, width_ratios=(2.2, 1.0))
    for who in summary["candidates"]:
        color = _COLORS[who["key"]]
        bins = [row for row in summary["bins"] if row["candidate"] == who["key"]]
        speed = [row["mean_speed_dps"] for row in bins]
        left.fill_between(speed, [r["q05_deg"] for r in bins], [r["q95_deg"] for r in bins], color=color, alpha=0.15, lw=0)
        label = f"{who['title']} ({who['lag_ms']:.0f} ms)"
        left.plot(
            speed, [r["median_deg"] for r in bins], color=color, marker=_SYMBOLS[who["key"]], markersize=4, lw=1.3, label=label
        )
    left.set_yscale("log")
    left.yaxis.set_major_formatter("{x:g}")
    left.set_xlim(left=0.0)
    left.set_xlabel("angular speed of the GH joint (°/s)")
    left.set_ylabel("error when published (°)")
    left.set_title("median and 5-95 % of the samples")
    places = range(len(summary["candidates"]))
    delays = [who["effective_delay_ms"] or 0.0 for who in summary["candidates"]]
    right.barh(places, delays, 0.6, color=[_COLORS[who["key"]] for who in summary["candidates"]])
    for place, delay in zip(places, delays, strict=True):
        right.annotate(f"{delay:.1f}", (delay, place), xytext=(3, 0), textcoords="offset points", va="center", fontsize=8)
    right.set_yticks(places, [textwrap.fill(who["title"], 14) for who in summary["candidates"]])
    right.invert_yaxis()
    right.set_xlim(0.0, 1.2 * max(delays))
    right.set_xlabel("behind the arm (ms)")
    right.set_title("slope of the curves")
    right.grid(axis="y", visible=False)
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    return figure
