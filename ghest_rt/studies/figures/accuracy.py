"""Figure 13: box plots of the errors of markers and arm."""

from collections.abc import Iterator, Sequence
from typing import Any, cast

from ghest_rt.studies.figures.style import METHOD_COLORS, Drawn, new_figure
from ghest_rt.studies.numbers import span_in_words
from ghest_rt.studies.paper_values import ACCURACY

_PANELS = (
    ("m0_m", "position of marker m0", "error (mm)", 1e3),
    ("m1_m", "position of marker m1", "error (mm)", 1e3),
    ("position_m", "position of the upper arm", "error (mm)", 1e3),
    ("orientation_deg", "orientation of the upper arm", "error (°)", 1.0),
)
_LEGEND_COLUMNS = 4
"""More would not fit the width."""

_BOX = ("whislo", "q1", "med", "q3", "whishi")


def figures(rows: Sequence[dict[str, object]], duration_s: float | None) -> Iterator[Drawn]:
    """Draw Figure 13 for every sensor; `duration_s` is how much of each movement was judged, None for all."""
    for sensor in dict.fromkeys(cast(str, row["sensor"]) for row in rows):
        caption = f"Figure 13: errors of markers and arm, sensor {sensor}, {span_in_words(duration_s)}"
        yield Drawn(f"figure13_{sensor}", caption, draw_figure_13(rows, sensor))


def draw_figure_13(rows: Sequence[dict[str, object]], sensor: str) -> Any:
    """Return Figure 13 for one sensor: per quantity and movement a box for each method, the paper's RMS as a bar.

    Args:
        rows: Rows of an accuracy study; of several seeds the first is drawn.
        sensor: Which sensor.
    """
    rows = [row for row in rows if row["sensor"] == sensor]
    seed = min(cast(int, row["seed"]) for row in rows)
    rows = [row for row in rows if row["seed"] == seed]
    movements = list(dict.fromkeys(cast(str, row["movement"]) for row in rows))
    methods = list(dict.fromkeys(cast(str, row["method"]) for row in rows))
    figure = new_figure(7.2, 5.6)
    width = 0.8 / len(methods)
    for axes, (quantity, title, label, scale) in zip(figure.subplots(2, 2).flat, _PANELS, strict=True):
        for index, method in enumerate(methods):
            places = [k + (index - (len(methods) - 1) / 2) * width for k in range(len(movements))]
            found = [_only(rows, quantity, method, movement) for movement in movements]
            boxes = [
                ({name: scale * cast(float, row[name]) for name in _BOX}, place)
                for row, place in zip(found, places, strict=True)
                if row["med"] is not None
            ]
            color = METHOD_COLORS[method]
            axes.bxp(
                [box for box, _ in boxes],
                positions=[place for _, place in boxes],
                widths=0.8 * width,
                showfliers=False,
                patch_artist=True,
                boxprops={"facecolor": color, "alpha": 0.55, "edgecolor": color},
                medianprops={"color": "black"},
                whiskerprops={"color": color},
                capprops={"color": color},
            )
            axes.plot([], [], color=color, linewidth=6, alpha=0.55, label=f"method {method}")
        if sensor == "paper":
            for k, movement in enumerate(movements):
                if movement in ACCURACY[quantity]:
                    rms = scale * ACCURACY[quantity][movement].rms
                    axes.plot([k - 0.42, k + 0.42], [rms, rms], color="0.25", linewidth=1.4, linestyle=(0, (4, 2)))
            axes.plot([], [], color="0.25", linewidth=1.4, linestyle=(0, (4, 2)), label="published RMS (Tables 5, 6)")
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_title(title)
        axes.set_ylabel(label)
        axes.set_xticks(range(len(movements)), movements)
        axes.grid(axis="x", visible=False)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), _LEGEND_COLUMNS), frameon=False)
    return figure


def _only(rows: Sequence[dict[str, object]], quantity: str, method: str, movement: str) -> dict[str, object]:
    return next(r for r in rows if (r["quantity"], r["method"], r["movement"]) == (quantity, method, movement))
