"""Several frames, one sample: which belong together. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection


@dataclass(frozen=True, slots=True)
class Assembled:
    """The parts of one sample.

    Attributes:
        values: What each part carried, by its key.
        counter: The counter they share, if they have one.
        t_bus_ns: Bus time of the first part.
        t_first_ns: Host arrival of the first part.
    """

    values: dict[int, tuple[float, ...]]
    counter: int | None
    t_bus_ns: int
    t_first_ns: int


class FrameAssembler:
    """Collects one part per key into a sample.

    Parts with a counter belong together when their counters are equal; parts without, when each key comes once. Either way
    they must arrive within the window. Parts of a sample that cannot be completed any more are dropped and counted.

    Args:
        keys: The parts of a sample.
        window_ns: Longest time from a sample's first part to its last.
        stats: Where incomplete and repeated ones are counted.
    """

    def __init__(self, keys: Sequence[int], window_ns: int, stats: LinkStats) -> None:
        self._wanted = len(set(keys))
        self._window_ns = window_ns
        self._stats = stats
        self._parts: dict[int, tuple[float, ...]] = {}
        self._counter: int | None = None
        self._t_bus_ns = 0
        self._t_first_ns = 0

    def add(
        self, key: int, values: tuple[float, ...], counter: int | None, *, t_bus_ns: int, t_arrival_ns: int
    ) -> Assembled | None:
        """Take in one part; return the sample that it completes."""
        in_time = t_arrival_ns - self._t_first_ns <= self._window_ns
        same = counter is not None and counter == self._counter
        if same and in_time and (key in self._parts or not self._parts):
            self._stats.rejected[Rejection.DUPLICATE] += 1
            return None
        if self._parts and (key in self._parts or not in_time or counter != self._counter):
            self._stats.rejected[Rejection.INCOMPLETE] += 1
            self._parts = {}
        if not self._parts:
            self._t_bus_ns, self._t_first_ns, self._counter = t_bus_ns, t_arrival_ns, counter
        self._parts[key] = values
        if len(self._parts) < self._wanted:
            return None
        values_by_key, self._parts = self._parts, {}
        return Assembled(values_by_key, counter, self._t_bus_ns, self._t_first_ns)
