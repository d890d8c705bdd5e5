"""One picture of a calibration: residuals over time, and the GH centre's uncertainty in both markers."""

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from ghest_rt.calibration.session import Session
from ghest_rt.calibration.solve import Found
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import Array

_AXES = "xyz"
_COLORS = ("#0072B2", "#D55E00", "#009E73")  # Okabe-Ito, safe for colour-blind readers
_CONFIDENCE = math.sqrt(5.991)  # 95 % of a normal distribution in two dimensions


def draw_calibration(session: Session, found: Found, out: Path) -> None:
    """Draw to a PNG, SVG or PDF file.

    Raises:
        BadInputError: `out` cannot be written.
    """
    figure = Figure(figsize=(10.0, 6.4), layout="constrained")
    grid = figure.add_gridspec(2, 4, height_ratios=(1.0, 0.9))
    over_time = figure.add_subplot(grid[0, :])
    over_time.axvspan(found.hold.start_s, found.hold.end_s, color="0.9", label="neutral posture")
    for axis in range(3):
        residual_mm = np.where(found.gh.used, 1000.0 * found.gh.residual_m[:, axis], np.nan)
        over_time.plot(session.t_s, residual_mm, color=_COLORS[axis], linewidth=0.9, label=_AXES[axis])
    over_time.set_xlabel("time (s)")
    over_time.set_ylabel("GH centre by m1\nagainst m0, E (mm)")
    over_time.legend(ncols=4, fontsize=9, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    over_time.grid(alpha=0.3)
    for marker, place in (("m0", 0), ("m1", 3)):
        covariance = 1e6 * found.gh.covariance[place : place + 3, place : place + 3]
        for column, (i, j) in enumerate(((0, 1), (2, 1))):
            axes = figure.add_subplot(grid[1, (place // 3) * 2 + column])
            _draw_ellipse(axes, covariance[np.ix_((i, j), (i, j))])
            axes.set_xlabel(f"{_AXES[i]} of {marker} (mm)")
            axes.set_ylabel(f"{_AXES[j]} of {marker} (mm)")
    figure.suptitle("Residuals, and 95 % region of the GH centre in each marker", fontsize=12)
    try:
        figure.savefig(out, dpi=130)
    except OSError as error:
        raise BadInputError(f"{out}: cannot be written: {error.strerror or error}") from error


def _draw_ellipse(axes: Axes, covariance_mm2: Array) -> None:
    values, vectors = np.linalg.eigh(covariance_mm2)
    semi = _CONFIDENCE * np.sqrt(np.clip(values, 1e-12, None))
    angle = math.degrees(math.atan2(vectors[1, 1], vectors[0, 1]))
    reach = 1.2 * float(semi[1])
    axes.add_patch(Ellipse((0.0, 0.0), 2 * semi[1], 2 * semi[0], angle=angle, facecolor="#0072B240", edgecolor="#0072B2"))
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    axes.grid(alpha=0.3)
