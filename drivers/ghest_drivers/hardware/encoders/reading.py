"""What a decoder makes of bytes or frames, before it has a unit or a host time."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RawReading:
    """All encoders at one instant, as the device counts.

    Attributes:
        counts: One value per channel, in the order of the link's channels.
        seq: The device's sample counter, wrapped; None if it sends none.
        ticks: The device's time, wrapped, in its own ticks; None if it sends none.
        status: The device's status bits, 0 if it sends none.
    """

    counts: tuple[float, ...]
    seq: int | None = None
    ticks: int | None = None
    status: int = 0
