"""Figures 14 to 17: errors and relative sensitivities as markers shift; and what goes beyond them."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, cast

from ghest_rt.studies.figures.style import METHOD_COLORS, PARAMETER_STYLES, Drawn, new_figure
from ghest_rt.studies.numbers import span_in_words
from ghest_rt.studies.paper_values import MEAN_RMSE_20_MM_DEG, PARAMETERS

Row = dict[str, object]

_S_LIMITS = (-1.0, 2.0)
_NEGLIGIBLE = 0.05
_WIDE = 0.2

FIGURES = {"SAbAd": "14", "SFE": "15", "SIR": "16", "COMB": "17"}
"""The paper's figure of each movement."""

_PANELS = (
    ("position_m_rms", "(a) position error of the arm", "error (mm)", 1e3),
    ("orientation_deg_rms", "(b) orientation error of the arm", "error (°)", 1.0),
    ("S_position", "(c) relative sensitivity, position", "S (dimensionless)", 1.0),
    ("S_orientation", "(d) relative sensitivity, orientation", "S (dimensionless)", 1.0),
)


def figures(summary: Mapping[str, Any]) -> Iterator[Drawn]:
    """Draw every figure of an analysis.

    Args:
        summary: Its summary.
    """
    rows, indices, sensor = summary["rows"], summary["sobol"]["indices"], summary["sensor"]
    movements, methods = (list(dict.fromkeys(cast(str, r[column]) for r in rows)) for column in ("movement", "method"))
    of_what = f"sensor {sensor}, {span_in_words(summary['duration_s'])}"
    caption = f"Errors against the translation of a marker, method by method: {of_what}"
    yield Drawn("drift_by_method", caption, draw_drift_by_method(rows, of_what))
    if any(r["group"] != "shift" for r in rows):
        yield Drawn("further", f"What the paper leaves out, at the largest amount: {of_what}", draw_further(rows))
    for movement in movements:
        number = FIGURES.get(movement, "")
        for method in methods:
            caption = f"Figure {number}".strip() + f": {movement}, method {method}, {of_what}"
            picture = draw_figure_14(rows, movement, method, of_what)
            yield Drawn(f"figure{number}_{movement}_{method}", caption, picture, folded=method != "paper")
    for movement in dict.fromkeys(cast(str, r["movement"]) for r in indices):
        caption = (
            f"Sobol indices on a surrogate of the chain, {movement}: N = {summary['sobol']['samples']} base samples, {of_what}"
        )
        yield Drawn(
            f"sobol_{movement}", caption, draw_sobol(indices, movement, summary["sobol"]["samples"]), folded=movement != "COMB"
        )


def draw_figure_14(rows: Sequence[Row], movement: str, method: str, of_what: str) -> Any:
    """Return the figure of one movement (14 SAbAd, 15 SFE, 16 SIR, 17 COMB) in the paper's four panels.

    Args:
        rows: Rows of a sensitivity analysis.
        movement: Which movement.
        method: Which method.
        of_what: Sensor and duration, in words.
    """
    chosen = [r for r in rows if (r["group"], r["movement"], r["method"]) == ("shift", movement, method)]
    figure = new_figure(7.2, 5.6)
    for axes, (column, title, label, scale) in zip(figure.subplots(2, 2).flat, _PANELS, strict=True):
        for name, (marker, axis) in PARAMETERS.items():
            color, line, symbol = PARAMETER_STYLES[name]
            curve = [r for r in chosen if r["parameter"] == name and r[column] is not None]
            axes.plot(
                [1e3 * cast(float, r["amount"]) for r in curve],
                [scale * cast(float, r[column]) for r in curve],
                color=color,
                linestyle=line,
                marker=symbol,
                markersize=3.5,
                linewidth=1.2,
                label=f"{name}: {marker} along {axis}",
            )
        if column.startswith("S_"):
            axes.axhline(1.0, color="0.4", linewidth=0.8, linestyle=":")
        axes.set_title(title + (_keep_within(axes, _S_LIMITS) if column.startswith("S_") else ""))
        axes.set_xlabel("translation of the marker (mm)")
        axes.set_ylabel(label)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    figure.suptitle(f"{movement}, method {method}: {of_what}", fontsize=9)
    return figure


def _keep_within(axes: Any, limits: tuple[float, float]) -> str:
    """Cut the axis where single values would flatten all others; return what the title is to say of it."""
    low, high = axes.get_ylim()
    axes.set_ylim(max(low, limits[0]), min(high, limits[1]))
    return "\n(some points lie beyond the axis)" if low < limits[0] or high > limits[1] else ""


def draw_drift_by_method(rows: Sequence[Row], of_what: str) -> Any:
    """Return the arm's orientation and position error against marker translation: a column for each method.

    The line is the mean over movements and q1 to q6, the band reaches from the least to the greatest of them; the means of the
    other methods are drawn thin.

    Args:
        rows: Rows of a sensitivity analysis.
        of_what: Sensor and duration, in words.
    """
    shifts = [r for r in rows if r["group"] == "shift"]
    methods = list(dict.fromkeys(cast(str, r["method"]) for r in shifts))
    figure = new_figure(7.2, 5.0)
    panels = figure.subplots(2, len(methods), sharex=True, sharey="row", squeeze=False)
    for line, (column, title, label, scale) in zip(panels, _PANELS[1::-1], strict=True):
        curves = {method: _spread(shifts, method, column, scale) for method in methods}
        for axes, method in zip(line, methods, strict=True):
            for other, (x, _, mean, _) in curves.items():
                if other != method:
                    axes.plot(x, mean, color=METHOD_COLORS[other], linewidth=0.8, linestyle="--")
            x, least, mean, greatest = curves[method]
            color = METHOD_COLORS[method]
            axes.fill_between(x, least, greatest, color=color, alpha=0.2, linewidth=0)
            axes.plot(x, mean, color=color, marker="o", markersize=3)
            axes.set_title(f"{method}: {title.partition(') ')[2]}", fontsize=8.5)
        line[0].set_ylabel(label)
        line[0].set_ylim(bottom=0.0)
    for axes in panels[-1]:
        axes.set_xlabel("translation (mm)")
    if "paper" in methods:
        panels[0][methods.index("paper")].plot(
            20.0, MEAN_RMSE_20_MM_DEG, marker="*", markersize=11, color="black", linestyle="none", label="published, 3.6°"
        )
    last = panels[0][0]
    last.plot([], [], color="0.4", marker="o", markersize=3, label="mean over movements and q1 to q6")
    last.fill_between([], [], color="0.4", alpha=0.2, label="least to greatest")
    last.plot([], [], color="0.4", linewidth=0.8, linestyle="--", label="the other methods' means")
    handles, labels = last.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    movements = ", ".join(dict.fromkeys(cast(str, r["movement"]) for r in shifts))
    figure.suptitle(f"Marker displaced: {movements}: {of_what}", fontsize=9)
    return figure


def _spread(
    shifts: Sequence[Row], method: str, column: str, scale: float
) -> tuple[list[float], list[float], list[float], list[float]]:
    """Return the amounts in millimetres at which something is known of a method, and least, mean and greatest error there."""
    by_amount: dict[float, list[float]] = {}
    for row in shifts:
        if row["method"] == method and row[column] is not None:
            by_amount.setdefault(cast(float, row["amount"]), []).append(scale * cast(float, row[column]))
    known = sorted(by_amount.items())
    return (
        [1e3 * amount for amount, _ in known],
        [min(values) for _, values in known],
        [sum(values) / len(values) for _, values in known],
        [max(values) for _, values in known],
    )


_GROUPS = {
    "turn": "markers turned on the body",
    "mount_turn": "camera mounts turned",
    "mount_shift": "camera mounts displaced",
    "encoder": "encoder bias",
    "both": "both markers displaced",
}


def draw_further(rows: Sequence[Row]) -> Any:
    """Return the arm's orientation error under what the paper leaves out, at the largest amount, mean over movements."""
    groups = [name for name in _GROUPS if any(r["group"] == name for r in rows)]
    methods = list(dict.fromkeys(cast(str, r["method"]) for r in rows))
    names = {g: list(dict.fromkeys(cast(str, r["parameter"]) for r in rows if r["group"] == g)) for g in groups}
    figure = new_figure(7.2, 1.2 + 0.17 * sum(len(several) + 1 for several in names.values()))
    panels = figure.subplots(
        len(groups), 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": [len(names[g]) for g in groups]}
    )
    height = 0.8 / len(methods)
    for axes, group in zip(panels[:, 0], groups, strict=True):
        of_group = [r for r in rows if r["group"] == group]
        largest = max(cast(float, r["amount"]) for r in of_group)
        unit = f"{largest:g}°" if of_group[0]["unit"] == "deg" else f"{1e3 * largest:g} mm"
        for index, method in enumerate(methods):
            means = []
            for name in names[group]:
                values = [
                    cast(float, r["orientation_deg_rms"])
                    for r in of_group
                    if (r["parameter"], r["method"], r["amount"]) == (name, method, largest)
                    and r["orientation_deg_rms"] is not None
                ]
                means.append(sum(values) / len(values) if values else float("nan"))
            places = [k + (index - (len(methods) - 1) / 2) * height for k in range(len(means))]
            axes.barh(places, means, 0.9 * height, color=METHOD_COLORS[method], label=f"method {method}")
        axes.set_yticks(range(len(names[group])), [name.removeprefix(f"{group} ") for name in names[group]])
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        axes.set_title(f"{_GROUPS[group]}, {unit} each", loc="left")
    panels[-1, 0].set_xlabel("orientation error of the arm (°), mean of the movements' RMS")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    return figure


def draw_sobol(rows: Sequence[Row], movement: str, samples: int) -> Any:
    """Return the Sobol indices of one movement, position and orientation side by side, with 95 % confidence intervals."""
    chosen = [r for r in rows if r["movement"] == movement]
    figure = new_figure(7.2, 5.8)
    panels = figure.subplots(1, 2, sharey=True, sharex=True)
    for axes, (output, title) in zip(
        panels, (("position_m", "position error"), ("orientation_deg", "orientation error")), strict=True
    ):
        of_output = [r for r in chosen if r["output"] == output and r["ST"] is not None]
        places = range(len(of_output))
        for shift, column, color, label in ((-0.2, "S1", "#56B4E9", "first order"), (0.2, "ST", "#D55E00", "total")):
            axes.barh(
                [k + shift for k in places],
                [cast(float, r[column]) for r in of_output],
                0.38,
                xerr=[cast(float, r[f"{column}_conf"]) for r in of_output],
                error_kw={"elinewidth": 0.7},
                color=color,
                label=label,
            )
        axes.set_yticks(places, [cast(str, r["parameter"]).replace("_", " ") for r in of_output])
        axes.set_title(title)
        axes.axvline(0.0, color="0.3", linewidth=0.8)
        axes.set_xlabel("share of the variance (dimensionless)")
        axes.grid(axis="y", visible=False)
    panels[0].invert_yaxis()
    unclear = _too_few(chosen)
    warning = f"\ntoo few samples to read: {unclear}" if unclear else ""
    figure.suptitle(f"{movement}, {samples} base samples; lines: 95 % confidence intervals{warning}", fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    return figure


def _too_few(rows: Sequence[Row]) -> str:
    """Say why indices cannot be read, or ""; with samples enough no share is negative beyond its confidence interval's half."""
    known = [row for row in rows if row["ST"] is not None]
    negative = sum(cast(float, row[column]) < -_NEGLIGIBLE for row in known for column in ("S1", "ST"))
    wide = sum(cast(float, row["ST_conf"]) > _WIDE for row in known)
    told = [f"{negative} shares negative" if negative else "", f"{wide} intervals wider than ± {_WIDE:g}" if wide else ""]
    return ", ".join(text for text in told if text)
