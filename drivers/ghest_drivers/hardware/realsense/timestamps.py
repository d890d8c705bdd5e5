"""RealSense time stamps to host monotonic time.

The SDK stamps a frame in milliseconds of one of three clocks, and may change from one to another while streaming:

- hardware clock: the device's own; its 32-bit microseconds wrap after 71.6 minutes and it may step back.
- global time: the device's clock, already mapped by the SDK to the host's *wall* clock.
- system time: the wall clock when the frame reached the SDK, no device time at all.
"""

from collections.abc import Callable
from enum import StrEnum

from ghest_drivers.clock_sync import ClockMap, wrap_period_ns

_WRAP_NS = wrap_period_ns(32, 1000)
_MAX_GLOBAL_AGE_NS = 1_000_000_000
_GLOBAL_SLACK_NS = 5_000_000


class TimeDomain(StrEnum):
    """Which clock a time stamp belongs to; the values are the SDK's names."""

    HARDWARE = "hardware_clock"
    GLOBAL = "global_time"
    SYSTEM = "system_time"


class StreamClock:
    """Maps the time stamps of one stream. One thread at a time.

    Args:
        latency_ns: Least time from the stamped instant to delivery, on the hardware clock.
        unix_ns: Reads the wall clock; None if the frames are played back, so that it has nothing to do with them.
    """

    def __init__(self, latency_ns: int, unix_ns: Callable[[], int] | None) -> None:
        self._unix_ns = unix_ns
        self._maps = {
            TimeDomain.HARDWARE: ClockMap(_WRAP_NS, latency_ns=latency_ns),
            TimeDomain.GLOBAL: ClockMap(latency_ns=latency_ns),
            TimeDomain.SYSTEM: ClockMap(),
        }

    def capture_ns(self, t_device_ns: int, domain: TimeDomain, t_arrival_ns: int, mid_exposure_ns: int) -> int | None:
        """Return the host time of mid-exposure, or None if the device time is not believable.

        Args:
            t_device_ns: The stamp.
            domain: Its clock.
            t_arrival_ns: Host monotonic time of delivery.
            mid_exposure_ns: Mid-exposure less the stamped instant (negative: the stamp is later).
        """
        if domain is TimeDomain.GLOBAL and self._unix_ns is not None:
            age_ns = self._unix_ns() - t_device_ns
            if -_GLOBAL_SLACK_NS <= age_ns <= _MAX_GLOBAL_AGE_NS:
                return min(t_arrival_ns - age_ns + mid_exposure_ns, t_arrival_ns)
        stamp_ns = self._maps[domain].stamp(t_device_ns, t_arrival_ns)
        return None if stamp_ns is None else min(stamp_ns + mid_exposure_ns, t_arrival_ns)


class RecordedClock:
    """Takes the device's time as host time: for a recording read faster than it was made, where arrival tells nothing."""

    def __init__(self) -> None:
        self._turns_ns = 0
        self._last_ns: int | None = None

    def capture_ns(self, t_device_ns: int, domain: TimeDomain, t_arrival_ns: int, mid_exposure_ns: int) -> int:
        """Return the unwrapped device time of mid-exposure; `t_arrival_ns` is not looked at."""
        if domain is TimeDomain.HARDWARE and self._last_ns is not None and self._last_ns - t_device_ns > _WRAP_NS // 2:
            self._turns_ns += _WRAP_NS
        self._last_ns = t_device_ns
        return t_device_ns + self._turns_ns + mid_exposure_ns
