"""Whether `fused` wins a row of the comparison, and if not, why."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ghest_rt.studies.numbers import number, percent
from ghest_rt.studies.rivals.angle_errors import ANGLES
from ghest_rt.studies.rivals.contenders import Contender

_JUDGED = ("orientation_deg", *ANGLES)
_WORDS = {
    "orientation_deg": "orientation",
    "flexion_deg": "flexion",
    "abduction_deg": "abduction",
    "rotation_deg": "rotation",
}
_FEWER = 0.01
"""By how much less `fused` may answer than another before that counts against it: methods start at different instants."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """The outcome of one row.

    Attributes:
        fused_wins: Whether `fused` has the smaller error in the rotation and in each angle, each judged at its own instant,
            where both answer, and answers as often.
        fused_wins_when_published: Whether its rotation is nearer at the instant at which each answer is published.
        lost_in: Quantities in which it does not win; `answered_fraction` if it is silent more often.
        verdict: The statement.
    """

    fused_wins: bool
    fused_wins_when_published: bool
    lost_in: tuple[str, ...]
    verdict: str


def verdict(
    who: Contender, theirs: Mapping[str, float], fused: Mapping[str, float], lag_ms: float, simple_forecast_deg: float
) -> Verdict:
    """Return the outcome of a row.

    Args:
        who: The contender.
        theirs: Its RMS errors by quantity where both answer, degrees, NaN where nothing was judged; and `answered_fraction`,
            the share of the instants at which it answers.
        fused: Those of `fused` at the same instants, and its share.
        lag_ms: How long after an instant the contender's answer is published.
        simple_forecast_deg: How far off the better of two simple forecasts is, one image ahead of the exact truth.
    """
    shares = theirs["answered_fraction"], fused["answered_fraction"]
    answered = f"answered are {percent(shares[1])} % of the instants against {percent(shares[0])} %"
    if shares[0] == 0.0 and shares[1] > 0.0:
        return Verdict(True, True, (), f"fused wins: {who.title} has no answer at all")
    if math.isnan(theirs["orientation_deg"]):
        return Verdict(False, False, ("answered_fraction",), f"fused never answers where {who.title} does: {answered}")
    lost = tuple(name for name in _JUDGED if not (math.isnan(theirs[name]) or fused[name] < theirs[name]))
    published = fused["published_deg"] < theirs["published_deg"]
    figures = f"{_deg(fused['orientation_deg'])} against {_deg(theirs['orientation_deg'])}"
    if not lost and shares[1] < shares[0] - _FEWER:
        return Verdict(
            False, published, ("answered_fraction",), f"fused is nearer ({figures}) but silent more often: {answered}"
        )
    if not lost:
        partly = f", where both answer; {answered}" if shares[0] < shares[1] - _FEWER else ""
        return Verdict(True, published, (), f"fused wins: {figures}{partly}")
    where = ", ".join(f"{_WORDS[name]} {_deg(fused[name])} against {_deg(theirs[name])}" for name in lost)
    if published and lag_ms > 0.0:
        late = (
            f"but that answer is published {lag_ms:.0f} ms after its instant; at the instants of publishing fused wins, "
            f"{_deg(fused['published_deg'])} against {_deg(theirs['published_deg'])}"
        )
        return Verdict(False, True, lost, f"judged at its own instant {who.title} is nearer ({where}), {late}")
    return Verdict(
        False,
        published,
        lost,
        f"fused does not win ({where}); {who.title} has on its side: {who.strength}"
        f"{_unforeseen(fused['orientation_deg'], simple_forecast_deg)}",
    )


def _unforeseen(fused_deg: float, simple_forecast_deg: float) -> str:
    """Say how the error of `fused` compares with what there was to foresee."""
    simple = f"a simple forecast from the exact truth one image ago is off by {_deg(simple_forecast_deg)}"
    if fused_deg <= 1.25 * simple_forecast_deg:
        return f"; fused has to foresee the movement from one image to the next, and this one is jerky: {simple}"
    return f"; {simple}: the forecast of fused does not reach what this movement allows"


def _deg(value: float) -> str:
    return "no answer" if math.isnan(value) else f"{number(value)}°"


@dataclass(frozen=True, slots=True)
class Tally:
    """How many rows `fused` wins.

    Attributes:
        rows: Of so many.
        own_instant: Each answer judged at its own instant.
        published: Judged at the instant of publishing.
    """

    rows: int
    own_instant: int
    published: int


def tally(verdicts: Sequence[Mapping[str, Any]], contender: str, sensor: str, kind: str) -> Tally:
    """Count the rows against a contender, of a sensor and a kind of movement."""
    mine = [v for v in verdicts if (v["contender"], v["sensor"], v["kind"]) == (contender, sensor, kind)]
    return Tally(len(mine), sum(v["fused_wins"] for v in mine), sum(v["fused_wins_when_published"] for v in mine))
