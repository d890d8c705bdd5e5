"""One picture of the benchmark results."""

from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

_OURS, _THEIRS = "#0072B2", "#D55E00"


def draw(results: dict[str, dict[str, Any]], out: Path) -> None:
    """Draw the timings that there are: pose beside ArUco, lateness beside the bare loop."""
    figure = Figure(figsize=(10.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    if "pose" in results:
        rows = [(name, value) for name, value in results["pose"].items() if isinstance(value, dict)]
        names = [name for name, _ in rows][::-1]
        medians = [value["median_ms"] for _, value in rows][::-1]
        spread = [value["p99_ms"] - value["median_ms"] for _, value in rows][::-1]
        colors = [_THEIRS if "ArUco" in name else _OURS for name in names]
        left.barh(names, medians, xerr=[[0.0] * len(spread), spread], color=colors, ecolor="0.4", capsize=3)
        left.set_xlabel("one marker pose from a 640x480 frame (ms): median, whisker to p99")
    if "loop" in results:
        loop = results["loop"]["fused"]
        groups = {"ghest-rt (fused)": loop["lateness_us"], "bare clock_nanosleep": loop["bare_clock_nanosleep_us"]}
        for offset, (name, values) in enumerate(groups.items()):
            positions = [k + 0.38 * offset for k in range(2)]
            right.bar(positions, [values["p50"], values["p99"]], width=0.36, label=name, color=(_OURS, _THEIRS)[offset])
        right.set_xticks([0.19, 1.19], ["p50", "p99"])
        right.set_ylabel("lateness of a tick (µs)")
        right.legend()
    figure.savefig(out, dpi=130)
