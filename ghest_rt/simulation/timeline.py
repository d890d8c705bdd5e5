"""Where the movement is on the recording's time axis."""

from dataclasses import dataclass

from ghest_rt.simulation.therapy import PAPER_RATE_HZ

_LEAD_PERIODS = 20  # 0.3 s: the encoders start before the cameras


@dataclass(frozen=True, slots=True)
class Timeline:
    """The movement starts 20 periods of 66.6 Hz after the recording's zero, so that a grid from zero meets its start.

    Attributes:
        duration_s: How much of the movement is recorded.
    """

    duration_s: float

    @property
    def start_ns(self) -> int:
        """Recording time of the movement's start."""
        return self.grid_ns(0)

    @property
    def end_ns(self) -> int:
        """Recording time of the movement's end."""
        return self.start_ns + round(self.duration_s * 1e9)

    def grid_ns(self, k: int) -> int:
        """Return the k-th instant of the 66.6 Hz grid since the movement's start: t_k = round(k / 66.6 s), free of drift."""
        return round((_LEAD_PERIODS + k) * 1e9 / PAPER_RATE_HZ)

    def movement_s(self, t_ns: int) -> float:
        """Return the movement's time at `t_ns`."""
        return (t_ns - self.start_ns) * 1e-9
