"""Percentiles of durations in constant memory: of all so far, and of the last few thousand."""

import math
from collections.abc import Sequence

import numpy as np

_PER_OCTAVE = 16
_OCTAVES = 24  # 1 us .. 16.8 s
_RECENT = 4096  # about a minute of ticks: enough for a 99.9th percentile


class DurationHistogram:
    """Durations sorted into logarithmic bins of 4.4 %, 1 µs to 16.8 s; the greatest is kept exactly."""

    def __init__(self) -> None:
        self._bins = [0] * (_PER_OCTAVE * _OCTAVES + 1)
        self._count = 0
        self._sum_ns = 0
        self._max_ns = 0

    @property
    def count(self) -> int:
        """How many durations have been added."""
        return self._count

    @property
    def sum_us(self) -> float:
        """All durations added up, microseconds."""
        return self._sum_ns / 1000.0

    @property
    def max_us(self) -> float:
        """The greatest duration, microseconds."""
        return self._max_ns / 1000.0

    def add(self, duration_ns: int) -> None:
        """Count a duration; a negative one counts as zero."""
        index = 0
        if duration_ns > 1000:
            index = min(math.ceil(_PER_OCTAVE * math.log2(duration_ns / 1000.0)), len(self._bins) - 1)
        self._bins[index] += 1
        self._count += 1
        self._sum_ns += max(duration_ns, 0)
        self._max_ns = max(self._max_ns, duration_ns)

    def percentile_us(self, percent: float) -> float:
        """Return the duration that `percent` of all do not exceed (its bin's upper edge), microseconds; 0 if there are none."""
        wanted = math.ceil(self._count * percent / 100.0)
        seen = 0
        for index, number in enumerate(self._bins):
            seen += number
            if number and seen >= wanted:
                return min(math.pow(2.0, index / _PER_OCTAVE), self.max_us)
        return 0.0

    def counts_up_to(self, octaves: Sequence[int]) -> tuple[int, ...]:
        """Return how many durations do not exceed 2^n µs, for each n given (0..23, rising); exact, since bins end there."""
        ends = [octave * _PER_OCTAVE + 1 for octave in octaves]
        return tuple(sum(self._bins[:end]) for end in ends)


class RecentDurations:
    """The last durations, exactly: after an hour of quiet a bad minute still shows.

    Args:
        capacity: How many are kept.
    """

    def __init__(self, capacity: int = _RECENT) -> None:
        self._ns = np.zeros(capacity, np.int64)
        self._added = 0

    def add(self, duration_ns: int) -> None:
        """Take in a duration in place of the oldest; a negative one counts as zero."""
        self._ns[self._added % len(self._ns)] = max(duration_ns, 0)
        self._added += 1

    def percentiles_us(self, percents: Sequence[float]) -> tuple[float, ...]:
        """Return the durations that so many percent do not exceed, microseconds; zeros if there are none."""
        count = min(self._added, len(self._ns))
        if count == 0:
            return (0.0,) * len(percents)
        ordered = np.sort(self._ns[:count])
        ranks = (min(max(math.ceil(count * percent / 100.0), 1), count) for percent in percents)
        return tuple(float(ordered[rank - 1]) / 1000.0 for rank in ranks)
