"""Device frame numbers to a sequence that never runs backwards."""

from ghest_drivers.hardware.cameras.stats import CameraStats

_MAX_GAP = 600  # ten seconds at 60 Hz: a greater gap is a restarted counter, not a loss


class FrameNumbering:
    """Turns the device's frame numbers into `seq`: a gap stays a gap, a restart of the counter goes on by one.

    Args:
        stats: Where gaps are counted.
    """

    def __init__(self, stats: CameraStats) -> None:
        self._number: int | None = None
        self._seq = -1
        self._stats = stats

    def next(self, number: int) -> int:
        """Return the sequence number of the frame that the device numbered `number`."""
        step = 1 if self._number is None else number - self._number
        if not 0 < step <= _MAX_GAP:
            step = 1
        self._number = number
        self._seq += step
        self._stats.missing += step - 1
        return self._seq
