"""Raw readings to encoder samples: sequence, time, angles; or a reason why not."""

from dataclasses import dataclass

import numpy as np

from ghest_drivers.clock_sync import ClockMap
from ghest_drivers.hardware.encoders.channels import AngleConverter, Channel
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection
from ghest_drivers.samples import EncoderSample

_MAX_LOSS = 1000  # a greater gap of the counter is a restart, not a loss


@dataclass(frozen=True, slots=True)
class Counting:
    """How the device counts samples and time.

    Attributes:
        seq_modulus: The sample counter starts again here; None if there is none.
        tick_ns: Length of one tick of the device's clock; None if it sends no time.
        wrap_ticks: The device's time starts again here; None if it never does.
        latency_ns: Least delay between latch and arrival.
        fault_mask: Status bits that mean that the angles are not to be trusted.
    """

    seq_modulus: int | None = None
    tick_ns: int | None = None
    wrap_ticks: int | None = None
    latency_ns: int = 0
    fault_mask: int = -1


class SampleBuilder:
    """Turns raw readings into samples, in the order of arrival.

    With a device time, `t_capture_ns` comes from the clock fit; without, it is the arrival less the known latency.
    """

    def __init__(
        self, channels: tuple[Channel, ...], counting: Counting, stats: LinkStats, clock: ClockMap | None = None
    ) -> None:
        """Begin a connection.

        Args:
            channels: The encoders.
            counting: How the device counts.
            stats: Where rejections are counted.
            clock: The fit of an earlier connection: a device's clock runs on when its cable is pulled, and only a known clock
                tells how old the samples are that come in a burst when it is back. A clock that started anew is noticed.
        """
        self._converter = AngleConverter(channels)
        self._counting = counting
        self._stats = stats
        wrap_ns = None
        if counting.tick_ns is not None and counting.wrap_ticks is not None:
            wrap_ns = counting.wrap_ticks * counting.tick_ns
        self.clock = clock or ClockMap(wrap_ns, latency_ns=counting.latency_ns)
        self._raw_seq: int | None = None
        self._raw_ticks: int | None = None
        self._seq = -1
        self._last_capture_ns: int | None = None

    def build(self, reading: RawReading, t_arrival_ns: int, t_first_ns: int | None = None) -> EncoderSample | None:
        """Return the sample, or None with the reason counted.

        `t_first_ns` is the arrival of the part of the reading whose time `reading.ticks` is, where it came in several.
        """
        result = self._judge(reading, t_arrival_ns, t_arrival_ns if t_first_ns is None else t_first_ns)
        if isinstance(result, Rejection):
            self._stats.rejected[result] += 1
            return None
        self._stats.accepted += 1
        return result

    def places_bursts(self, last: RawReading, t_arrival_ns: int) -> bool:
        """Whether several readings that arrive at once, up to `last`, can each be placed in time. To be asked before `build`.

        Without a device time they cannot, nor right after opening, when nothing tells how late the first of them is.
        """
        if last.ticks is None or self._counting.tick_ns is None or not self.clock.ready:
            return False
        self.clock.foresee(last.ticks * self._counting.tick_ns, t_arrival_ns)
        return True

    def _judge(self, reading: RawReading, t_arrival_ns: int, t_first_ns: int) -> EncoderSample | Rejection:
        if self._counted_before(reading):
            return Rejection.DUPLICATE
        if reading.status & self._counting.fault_mask:
            return Rejection.DEVICE_FAULT
        times = self._times(reading, t_first_ns)
        if times is None:
            return Rejection.CLOCK_SUSPECT
        t_device_ns, t_capture_ns = times
        if self._last_capture_ns is not None and t_capture_ns <= self._last_capture_ns:
            return Rejection.NOT_ADVANCING
        angles = self._converter.convert(reading.counts, t_capture_ns)
        if isinstance(angles, Rejection):
            return angles
        self._last_capture_ns = t_capture_ns
        return EncoderSample(self._seq, np.array(angles), t_device_ns, t_arrival_ns, t_capture_ns)

    def _counted_before(self, reading: RawReading) -> bool:
        """Advance the sample count; whether this reading repeats the last one."""
        same_time = reading.ticks is not None and reading.ticks == self._raw_ticks
        self._raw_ticks = reading.ticks
        if reading.seq is None or self._counting.seq_modulus is None:
            if same_time:
                return True
            self._seq += 1
            return False
        step = 1 if self._raw_seq is None else (reading.seq - self._raw_seq) % self._counting.seq_modulus
        self._raw_seq = reading.seq
        if step == 0 and (same_time or reading.ticks is None):
            return True
        if step == 0 or step > min(_MAX_LOSS, self._counting.seq_modulus // 2):
            self._stats.seq_jumps += 1
            step = 1
        self._stats.lost += step - 1
        self._seq += step
        return False

    def _times(self, reading: RawReading, t_arrival_ns: int) -> tuple[int, int] | None:
        if reading.ticks is None or self._counting.tick_ns is None:
            t_latch_ns = t_arrival_ns - self._counting.latency_ns
            return t_latch_ns, t_latch_ns
        t_device_ns = reading.ticks * self._counting.tick_ns
        t_capture_ns = self.clock.stamp(t_device_ns, t_arrival_ns)
        return None if t_capture_ns is None else (t_device_ns, t_capture_ns)
