"""The simulated conditions that the filter's consistency is judged under."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from ghest_rt.simulation.disturbances import parse_shift, parse_turn
from ghest_rt.simulation.faults import parse_fault
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.vision.station import Method

TUNING_SEEDS = (11,)
"""Seeds that priors and noise were chosen with."""

HELD_OUT_SEEDS = (201, 202, 203)
"""Seeds to judge with; docs/fused-estimator.md says which of them have been looked at."""

DURATION_S = 6.0

_MOVEMENTS = ("SFE", "SAbAd", "SIR", "COMB")


@dataclass(frozen=True, slots=True)
class Condition:
    """A kind of session.

    Attributes:
        group: What it belongs to.
        name: What is special about it; names its calibration session too, so that another name is another session.
        options: What to simulate; the seed is still open.
        vision: Which detectors see it.
    """

    group: str
    name: str
    options: SimulateOptions
    vision: Method = "photometric"

    @property
    def title(self) -> str:
        """The name in words."""
        options = self.options
        if self.group == "plain":
            parts = [f"{options.movement}, sensor {options.sensor}"]
            parts += [f"detectors {self.vision}"] if self.vision != "photometric" else []
            parts += ["left arm"] if options.arm == "left" else []
            return ", ".join(parts)
        words = self.name.replace(" deg", "°").replace("@", ", from ")
        return f"{words} s" if "@" in self.name else words

    def seeded(self, seed: int) -> SimulateOptions:
        """Return what to simulate with a seed."""
        return replace(self.options, seed=seed)


def conditions() -> tuple[Condition, ...]:
    """Return all of them."""
    return (*_plain(), *_moved_markers(), *_soft(), *_faults())


def _options(movement: str, **more: object) -> SimulateOptions:
    return replace(SimulateOptions(out=Path(), movement=movement, duration_s=DURATION_S), **more)  # type: ignore[arg-type]  # fields by name


def _plain() -> Iterable[Condition]:
    for movement in _MOVEMENTS:
        yield Condition("plain", f"{movement} paper", _options(movement))
        yield Condition("plain", f"{movement} paper refined", _options(movement), "refined")
        yield Condition("plain", f"{movement} sr300", _options(movement, sensor="sr300"))
    yield Condition("plain", "COMB left", _options("COMB", arm="left"))


def _moved_markers() -> Iterable[Condition]:
    for marker in ("m0", "m1"):
        for axis in "xyz":
            for begin in ("", "@2"):
                moves = (parse_shift(f"{marker}:{axis}:0.02{begin}"),)
                yield Condition("slide", f"{marker} {axis} 20 mm{begin}", _options("COMB", marker_moves=moves))
                moves = (parse_turn(f"{marker}:{axis}:5{begin}"),)
                yield Condition("turn", f"{marker} {axis} 5 deg{begin}", _options("COMB", marker_moves=moves))


def _soft() -> Iterable[Condition]:
    for movement in _MOVEMENTS:
        yield Condition("soft tissue", f"{movement} published", _options(movement, soft_tissue="published"))


def _faults() -> Iterable[Condition]:
    for fault in ("blind:r0:3:0.5", "blind:r1:3:0.5", "depth-lost:r0:2:2", "depth-lost:r1:2:2", "drop:r1:0.3"):
        yield Condition("fault", fault, _options("COMB", faults=(parse_fault(fault),)))
