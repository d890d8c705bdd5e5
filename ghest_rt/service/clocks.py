"""A clock that runs faster or slower than the host's, so that a replay at another speed is the same run on another clock."""

import time
from typing import Protocol

from ghest_drivers.clock import Clock


class ServiceClock(Clock, Protocol):
    """A clock whose instants can be found on the host's."""

    def monotonic_of(self, t_ns: int) -> int:
        """Return the CLOCK_MONOTONIC instant at which this clock shows `t_ns`."""
        ...


class ScaledClock:
    """Shows host time at the moment of its making and runs at `speed` from then on; speed 1 is the host's monotonic clock."""

    def __init__(self, speed: float = 1.0) -> None:
        self._speed = speed
        self._origin_ns = time.monotonic_ns() if speed != 1.0 else 0

    def now_ns(self) -> int:
        """Return the present time in nanoseconds."""
        if self._speed == 1.0:
            return time.monotonic_ns()
        return self._origin_ns + round((time.monotonic_ns() - self._origin_ns) * self._speed)

    def sleep_until_ns(self, t_ns: int) -> None:
        """Sleep until this clock shows `t_ns`."""
        delay_ns = self.monotonic_of(t_ns) - time.monotonic_ns()
        if delay_ns > 0:
            time.sleep(delay_ns * 1e-9)

    def monotonic_of(self, t_ns: int) -> int:
        """Return the CLOCK_MONOTONIC instant at which this clock shows `t_ns`."""
        if self._speed == 1.0:
            return t_ns
        return self._origin_ns + round((t_ns - self._origin_ns) / self._speed)
