"""Percentiles of durations in constant memory."""

import math

_PER_OCTAVE = 16
_OCTAVES = 24  # 1 us .. 16.8 s


class DurationHistogram:
    """Durations sorted into logarithmic bins of 4.4 %, 1 µs to 16.8 s; the greatest is kept exactly."""

    def __init__(self) -> None:
        self._bins = [0] * (_PER_OCTAVE * _OCTAVES + 1)
        self._count = 0
        self._max_ns = 0

    @property
    def count(self) -> int:
        """How many durations have been added."""
        return self._count

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
