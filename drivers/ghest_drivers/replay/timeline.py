"""From a recording's time to the clock's: the axis that a replay moves its samples to."""

from dataclasses import replace
from typing import TypeVar

from ghest_drivers.samples import EncoderSample, RgbdFrame

_S = TypeVar("_S", RgbdFrame, EncoderSample)


class Timeline:
    """host = start + (recorded - first) / speed; exact, in whole nanoseconds, at speed 1.

    Attributes:
        first_ns: Recorded arrival of the first sample, None until it is known.
        start_ns: The clock's time at which it is due, None until somebody reads.
    """

    def __init__(self, speed: float) -> None:
        self.first_ns: int | None = None
        self.start_ns: int | None = None
        self._speed = speed

    @property
    def fixed(self) -> bool:
        """Whether the axis is known."""
        return self.first_ns is not None and self.start_ns is not None

    def to_clock_ns(self, t_ns: int) -> int:
        """Return the clock's time of a recorded time; before the axis is fixed, as if it started at 0."""
        passed_ns = t_ns - (self.first_ns or 0)
        return (self.start_ns or 0) + (passed_ns if self._speed == 1.0 else round(passed_ns / self._speed))

    def to_recording_ns(self, t_ns: int) -> int:
        """Return the recorded time of a time of the clock.

        Raises:
            ValueError: Nothing has been read yet.
        """
        if self.start_ns is None or self.first_ns is None:
            raise ValueError("nothing has been read yet: the time axis is not fixed")
        passed_ns = t_ns - self.start_ns
        return self.first_ns + (passed_ns if self._speed == 1.0 else round(passed_ns * self._speed))

    def moved(self, sample: _S) -> _S:
        """Return a sample with its host times moved to the clock's axis."""
        t_arrival_ns, t_capture_ns = self.to_clock_ns(sample.t_arrival_ns), self.to_clock_ns(sample.t_capture_ns)
        if isinstance(sample, RgbdFrame):
            t_depth_ns = self.to_clock_ns(sample.t_depth_capture_ns)
            return replace(sample, t_arrival_ns=t_arrival_ns, t_capture_ns=t_capture_ns, t_depth_capture_ns=t_depth_ns)
        return replace(sample, t_arrival_ns=t_arrival_ns, t_capture_ns=t_capture_ns)
