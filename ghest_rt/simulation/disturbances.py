"""What goes wrong with the markers of a simulated session, and how it is written on the command line.

The estimator is not told: the station file that goes with a recording stays as calibrated.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from ghest_rt.errors import BadInputError

MarkerName = Literal["m0", "m1"]
SoftTissueName = Literal["none", "published", "severe"]

RAMP_S = 1.0
"""A drift that begins during the recording takes this long."""

MAX_SHIFT_M = 0.1
MAX_TURN_DEG = 60.0

MARKERS: tuple[MarkerName, ...] = ("m0", "m1")
"""The markers of the scene."""

_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, slots=True)
class MarkerMove:
    """A marker that is not, or not for long, where the calibration says.

    Attributes:
        marker: Which one.
        kind: "shift": displaced along the axes of the GH frame (m0) or of the elbow frame (m1), as in the paper's Table 3;
            "turn": turned about its own centre and its own axes.
        axis: 0, 1, 2 for x, y, z.
        amount: Metres of a shift, radians of a turn.
        start_s: Time of the movement at which it begins; None for from before the recording.
        text: As given on the command line.
    """

    marker: MarkerName
    kind: Literal["shift", "turn"]
    axis: int
    amount: float
    start_s: float | None
    text: str

    def at(self, t_s: float) -> float:
        """Return how much of it there is at `t_s` of the movement (m, rad): none, a minimum-jerk ramp, all."""
        if self.start_s is None:
            return self.amount
        x = min(1.0, max(0.0, (t_s - self.start_s) / RAMP_S))
        return self.amount * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


def parse_shift(text: str) -> MarkerMove:
    """Return the move of `--marker-shift MARKER:AXIS:METRES[@START_S]`.

    Raises:
        BadInputError: It is not of that form; the text says which part.
    """
    return _parse(text, "shift")


def parse_turn(text: str) -> MarkerMove:
    """Return the move of `--marker-turn MARKER:AXIS:DEGREES[@START_S]`.

    Raises:
        BadInputError: It is not of that form; the text says which part.
    """
    return _parse(text, "turn")


def check_moves(moves: Sequence[MarkerMove], duration_s: float) -> None:
    """Refuse moves that begin after the end, and those that come to more together than one alone may be.

    Raises:
        BadInputError: There is one; the text says which option.
    """
    for move in moves:
        start_s = move.start_s or 0.0
        if start_s >= duration_s:
            raise BadInputError(
                f"--marker-{move.kind} {move.text}: begins after the end, {duration_s:g} s: give an earlier second or "
                "simulate longer"
            )
        alike = [other for other in moves if (other.marker, other.kind, other.axis) == (move.marker, move.kind, move.axis)]
        begun = [other for other in alike if (other.start_s or 0.0) <= start_s]
        limit, unit, scale = (MAX_SHIFT_M, "m", 1.0) if move.kind == "shift" else (MAX_TURN_DEG, "°", 180.0 / math.pi)
        together = scale * sum(other.amount for other in begun)
        if abs(together) > limit + 1e-9:
            raise BadInputError(
                f"--marker-{move.kind} {', '.join(other.text for other in begun)}: together {together:g} {unit}: "
                f"stay within {limit:g} {unit}"
            )


def number(option: str, part: str, text: str, limits: tuple[float, float], remedy: str) -> float:
    """Return a number given as part of an option.

    Raises:
        BadInputError: It is none, or outside `limits`; the text ends with the remedy.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    low, high = limits
    if not low <= value <= high:
        raise BadInputError(f"{option}: {part} {text!r} cannot be used: {remedy}")
    return value


def _parse(text: str, kind: Literal["shift", "turn"]) -> MarkerMove:
    unit = "METRES" if kind == "shift" else "DEGREES"
    option = f"--marker-{kind} {text}"
    body, at, start = text.partition("@")
    parts = body.split(":")
    if len(parts) != 3:
        example = "m1:x:0.02" if kind == "shift" else "m0:z:5"
        raise BadInputError(
            f"{option}: {len(parts)} parts where 3 belong: give it as MARKER:AXIS:{unit}[@START_S], "
            f"such as {example} or {example}@4"
        )
    name, axis, amount = parts
    marker = next((marker for marker in MARKERS if marker == name), None)
    if marker is None:
        raise BadInputError(f"{option}: marker {name!r} is unknown: give {' or '.join(MARKERS)}")
    if axis not in _AXES:
        raise BadInputError(f"{option}: axis {axis!r} is unknown: give x, y or z")
    limit = MAX_SHIFT_M if kind == "shift" else MAX_TURN_DEG
    value = number(option, unit.lower(), amount, (-limit, limit), f"give a number from {-limit:g} to {limit:g}")
    start_s = number(option, "start", start, (0.0, 1e6), "give the second of the movement at which it begins") if at else None
    return MarkerMove(marker, kind, _AXES[axis], value if kind == "shift" else math.radians(value), start_s, text)
