"""When a client calls what it gets late, stale or lost."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """Times by the receiver's own monotonic clock, seconds.

    Attributes:
        stale_after_s: Without a sample for so long a station is stale; ten slots of the 66.6 Hz grid.
        lost_after_s: Without a sample for so long it is lost, though its liveliness token stands.
        max_delay_s: Samples that come this much later than the quickest ones do not make a station live: they are old. Infinite
            for a service that replays slower than real time, whose clock falls behind.
        fill_within_s: How long newer samples wait in order for missing ones to be delivered again.
    """

    stale_after_s: float = 0.15
    lost_after_s: float = 2.0
    max_delay_s: float = 0.15
    fill_within_s: float = 0.5

    def __post_init__(self) -> None:
        if not (0.0 < self.stale_after_s <= self.lost_after_s and self.max_delay_s > 0.0 and self.fill_within_s > 0.0):
            raise ValueError(f"limits are positive, and stale comes before lost: {self}")
