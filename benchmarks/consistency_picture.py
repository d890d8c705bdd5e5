"""The picture of the consistency benchmark: coverage by condition, and NEES and NIS beside what they should be."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

HISTOGRAM_EDGES = np.linspace(0.0, 20.0, 61)
"""Of NEES and NIS; what is above the last counts in the last bin."""

_GROUPS = {"plain": "undisturbed"}
_ANGLES = (("flexion", "o", "#0072B2"), ("abduction", "s", "#D55E00"), ("rotation", "^", "#009E73"))
_LEAST_PERCENT = 60.0
_APART = 0.24  # of a row, between the angles' symbols


def draw(conditions: Sequence[Mapping[str, Any]], histograms: Mapping[str, Sequence[float]], out: Path) -> None:
    """Draw.

    Args:
        conditions: Each with `group`, `title` and `coverage_percent`, that of the three angles.
        histograms: Densities of the `nees` and `nis` of undisturbed sessions in the bins of `HISTOGRAM_EDGES`.
        out: The picture.
    """
    figure = Figure(figsize=(11.5, max(5.0, 0.27 * len(conditions) + 1.4)), layout="constrained")
    left, upper, lower = figure.subplot_mosaic(
        [["coverage", "nees"], ["coverage", "nis"], ["coverage", "."]], width_ratios=(2.0, 1.0), height_ratios=(1.0, 1.0, 1.0)
    ).values()
    groups = list(dict.fromkeys(condition["group"] for condition in conditions))
    _draw_coverage(left, sorted(conditions, key=lambda condition: groups.index(condition["group"])))
    x = np.linspace(0.01, HISTOGRAM_EDGES[-1], 400)
    for axes, name, freedom, density in (
        (upper, "nees", 3, np.sqrt(x / (2 * np.pi)) * np.exp(-x / 2)),
        (lower, "nis", 6, x**2 * np.exp(-x / 2) / 16.0),
    ):
        axes.stairs(histograms[name], HISTOGRAM_EDGES, fill=True, alpha=0.5, color="#0072B2", label="undisturbed sessions")
        axes.plot(x, density, "k", lw=1, label="chi-squared")
        axes.set(
            title=f"{name.upper()}, {freedom} degrees of freedom",
            xlabel="value (all above 20 in the last bin)",
            ylabel="probability density",
        )
        axes.legend(fontsize=8)
    figure.savefig(out, dpi=110)


def _draw_coverage(axes: Any, conditions: Sequence[Mapping[str, Any]]) -> None:
    rows = np.arange(len(conditions))[::-1]
    axes.axvspan(93, 97, color="#009E73", alpha=0.2, label="93 to 97 %")
    for index, (name, symbol, color) in enumerate(_ANGLES):
        shares = np.array([condition["coverage_percent"][index] for condition in conditions])
        places = rows + _APART * (1 - index)
        axes.plot(np.maximum(shares, _LEAST_PERCENT), places, symbol, color=color, ms=4.5, label=name)
        for share, place in zip(shares, places, strict=True):
            if share < _LEAST_PERCENT:
                axes.annotate(
                    f"{share:.0f} %",
                    (_LEAST_PERCENT, place),
                    xytext=(_LEAST_PERCENT + 2.5 + 4.0 * index, place),
                    arrowprops={"arrowstyle": "->", "color": color, "lw": 0.8},
                    va="center",
                    fontsize=7,
                    color=color,
                )
    axes.set_yticks(rows, [f"{_GROUPS.get(c['group'], c['group'])}: {c['title']}" for c in conditions], fontsize=8)
    for row, (one, other) in enumerate(pairwise(conditions)):
        if one["group"] != other["group"]:
            axes.axhline(rows[row] - 0.5, color="0.4", lw=0.8)
    axes.set(
        title="Coverage by condition",
        xlabel=f"95 % intervals that hold the truth (%); arrows: below {_LEAST_PERCENT:g} %",
        xlim=(_LEAST_PERCENT - 0.7, 100.7),
        ylim=(-0.7, len(conditions) - 0.3),
    )
    axes.grid(axis="x", alpha=0.3)
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.035), ncols=4, frameon=False)
