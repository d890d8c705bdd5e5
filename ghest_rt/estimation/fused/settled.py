"""How something was at first, and how it is of late."""

import numpy as np

from ghest_rt.geometry.so3 import Array

# Samples farther apart than this are not joined.
_GAP_S = 0.2


class Settled:
    """Running means of a vector: over the first seconds, and over the last one or so.

    Attributes:
        first: (n,) mean over the first seconds.
        recent: (n,) mean with an exponential memory, which fills up at first.
        ready: Whether the first seconds are over.
    """

    def __init__(self, size: int, first_s: float, memory_s: float) -> None:
        """Start without samples.

        Args:
            size: n.
            first_s: How much makes up the first seconds.
            memory_s: Time constant of the recent mean.
        """
        self.first = np.zeros(size)
        self.recent = np.zeros(size)
        self._wanted_s, self._memory_s = first_s, memory_s
        self._taken_s = self._filled_s = 0.0
        self._t_ns: int | None = None

    @property
    def ready(self) -> bool:
        """Whether the first seconds are over."""
        return self._taken_s >= self._wanted_s

    @property
    def started(self) -> bool:
        """Whether there is anything of them."""
        return self._taken_s > 0.0

    def add(self, t_ns: int, value: Array) -> float:
        """Take a (n,) value at `t_ns`; return the time since the one before, s: 0 for the first, after a gap, or late."""
        dt = 0.0 if self._t_ns is None else (t_ns - self._t_ns) * 1e-9
        if dt < 0.0:
            return 0.0
        self._t_ns = t_ns
        if dt > _GAP_S or dt == 0.0:
            return 0.0
        self._filled_s = min(self._filled_s + dt, self._memory_s)
        self.recent = self.recent + (dt / self._filled_s) * (value - self.recent)
        if not self.ready:
            self._taken_s += dt
            self.first = self.first + (dt / self._taken_s) * (value - self.first)
        return dt
