"""Figures of the comparison: every contender's errors, movement by movement, its publication's figure beside."""

from collections.abc import Iterator, Sequence
from typing import Any, cast

from ghest_rt.studies.figures.style import METHOD_COLORS, Drawn, new_figure
from ghest_rt.studies.numbers import span_in_words

Row = dict[str, Any]

_OTHERS_COLOR = "0.45"
_KINDS = {"therapy": ("o", "Table 2's movements"), "recorded": ("^", "recorded movements of people")}
_ANGLES = (("flexion_deg", "flexion"), ("abduction_deg", "abduction"), ("rotation_deg", "rotation"))
_VIEWS = (
    ("orientation_deg", "judged at the answer's own instant"),
    ("published_deg", "judged at the instant of publishing"),
)
_LEAST_DEG = 1e-3


def figures(summary: Row) -> Iterator[Drawn]:
    """Draw the figures of every sensor.

    Args:
        summary: Summary of `study compare`.
    """
    for sensor in summary["settings"]["sensors"]:
        of_what = f"sensor {sensor}, {span_in_words(summary['settings']['duration_s'])}"
        caption = f"Errors of the GH rotation; a symbol per movement: {of_what}"
        yield Drawn(f"contenders_{sensor}", caption, draw_contenders(summary, sensor))
        yield Drawn(f"angles_{sensor}", f"Errors angle by angle: {of_what}", draw_angles(summary, sensor))


def draw_contenders(summary: Row, sensor: str) -> Any:
    """Return the errors of the GH rotation of every contender: a symbol per movement, a bar at the mean over Table 2's.

    Args:
        summary: Summary of `study compare`.
        sensor: Which sensor.
    """
    figure = new_figure(7.2, 4.2)
    panels = figure.subplots(1, 2, sharey=True, sharex=True)
    for axes, (quantity, title) in zip(panels, _VIEWS, strict=True):
        _draw_panel(axes, summary, sensor, quantity)
        axes.set_title(title)
        axes.set_xlabel("error of the GH rotation (° RMS)")
    stars = [(who["published_deg"], k) for k, who in enumerate(summary["contenders"]) if who["published_deg"] is not None]
    x, y = zip(*stars, strict=True)
    panels[0].plot(x, y, marker="*", markersize=9, color="black", linestyle="none", label="in its own publication")
    _finish(figure, panels, summary)
    return figure


def draw_angles(summary: Row, sensor: str) -> Any:
    """Return the same angle by angle: flexion, horizontal abduction, internal rotation."""
    figure = new_figure(7.2, 4.2)
    panels = figure.subplots(1, 3, sharey=True, sharex=True)
    for axes, (quantity, title) in zip(panels, _ANGLES, strict=True):
        _draw_panel(axes, summary, sensor, quantity)
        axes.set_title(title)
        axes.set_xlabel("error (° RMS)")
    _finish(figure, panels, summary)
    return figure


def _draw_panel(axes: Any, summary: Row, sensor: str, quantity: str) -> None:
    for k, who in enumerate(summary["contenders"]):
        color = METHOD_COLORS[who["key"]] if who["ours"] else _OTHERS_COLOR
        rows = [r for r in summary["rows"] if (r["sensor"], r["contender"]) == (sensor, who["key"])]
        for kind, (symbol, _) in _KINDS.items():
            values = [max(_LEAST_DEG, r[quantity]) for r in rows if r["kind"] == kind and r[quantity] is not None]
            axes.plot(values, [k] * len(values), linestyle="none", marker=symbol, markersize=5, color=color, alpha=0.55)
        for group in who["measured"]:
            mean = cast(float | None, group[quantity])
            if group["sensor"] == sensor and group["kind"] == "therapy" and mean is not None:
                axes.plot([mean, mean], [k - 0.32, k + 0.32], color=color, linewidth=2.4)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.grid(axis="y", visible=False)


def _finish(figure: Any, panels: Sequence[Any], summary: Row) -> None:
    first = panels[0]
    first.set_yticks(range(len(summary["contenders"])), [who["title"] for who in summary["contenders"]])
    first.set_ylim(len(summary["contenders"]) - 0.4, -0.6)
    kinds = {row["kind"] for row in summary["rows"]}
    for kind, (symbol, title) in _KINDS.items():
        if kind in kinds:
            first.plot([], [], linestyle="none", marker=symbol, color=_OTHERS_COLOR, label=title)
    if "therapy" in kinds:
        first.plot([], [], color=_OTHERS_COLOR, linewidth=2.4, label="mean of Table 2's")
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
