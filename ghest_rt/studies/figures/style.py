"""How figures look, and how they are written: colours safe for colour-blind readers, units on every axis."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ghest_rt.errors import GhestError
from ghest_rt.extras import need_extra

ENDINGS = (".png", ".svg", ".pdf")
"""Every figure is written in these formats."""

METHOD_COLORS: Mapping[str, str] = {
    "paper": "#D55E00",
    "refined": "#0072B2",
    "photometric": "#56B4E9",
    "fused": "#009E73",
    "aruco": "#CC79A7",
}
"""Okabe and Ito's colours by method."""

PARAMETER_STYLES: Mapping[str, tuple[str, str, str]] = {
    "q1": ("#E69F00", "-", "o"),
    "q2": ("#D55E00", "-", "s"),
    "q3": ("#CC79A7", "-", "^"),
    "q4": ("#56B4E9", "--", "o"),
    "q5": ("#0072B2", "--", "s"),
    "q6": ("#009E73", "--", "^"),
}
"""Colour, line and symbol of q1 to q6: warm and solid for m0, cold and dashed for m1, so that print in grey works too."""

_STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.labelsize": 9,
    "legend.fontsize": 8,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "ghest-rt",
    "pdf.fonttype": 42,
    "figure.dpi": 110,
    "savefig.dpi": 200,
}


@dataclass(frozen=True, slots=True, eq=False)
class Drawn:
    """A figure of a study.

    Attributes:
        name: Of its files, without an ending.
        caption: What it shows.
        picture: The Matplotlib figure.
        folded: Whether the report shows it only on request.
    """

    name: str
    caption: str
    picture: Any
    folded: bool = False


def new_figure(width_in: float, height_in: float) -> Any:
    """Return an empty Matplotlib figure.

    Raises:
        GhestError: Matplotlib is not installed.
    """
    need_extra("study", "a figure")
    import matplotlib as mpl  # noqa: PLC0415 - an extra, imported only when used
    from matplotlib.figure import Figure  # noqa: PLC0415

    mpl.rcParams.update(_STYLE)
    return Figure(figsize=(width_in, height_in), layout="constrained")


def save_figure(figure: Any, folder: Path, name: str) -> list[Path]:
    """Write a figure as PNG, SVG and PDF; the same figure gives the same bytes. Returns the paths.

    Raises:
        GhestError: The folder cannot be written to.
    """
    paths = [folder / f"{name}{ending}" for ending in ENDINGS]
    undated: Mapping[str, dict[str, None]] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in paths:
            figure.savefig(path, metadata=undated[path.suffix])
    except OSError as error:
        raise GhestError(f"{folder}: cannot be written to: {error.strerror or error}") from error
    return paths
