"""What all encoder links share: a bounded queue between whoever receives and the one coroutine that reads."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Sequence

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceLost, DriverError, ReadTimeout
from ghest_drivers.hardware.encoders.builder import Counting, SampleBuilder
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection
from ghest_drivers.hardware.encoders.wakeup import Wakeup
from ghest_drivers.samples import DeviceVitals, EncoderInfo, EncoderSample

_QUEUE = 4096
_NS_PER_S = 1_000_000_000


class SampleQueueLink(ABC):
    """Base of the hardware encoder links: implements `EncoderLink` but for connecting and disconnecting.

    A link that brings no acceptable sample for `silent_s` counts as lost, whatever else arrives, so that its owner re-opens it.

    Args:
        name: Where it is connected, for messages.
        channels: The encoders, in the order of the angles delivered.
        counting: How the device counts samples and time.
        clock: Host monotonic clock.
        silent_s: Longest silence before `read` raises DeviceLost.
    """

    def __init__(
        self, name: str, channels: tuple[Channel, ...], counting: Counting, clock: Clock, *, silent_s: float = 1.0
    ) -> None:
        self._name = name
        self._channels = channels
        self._counting = counting
        self._clock = clock
        self._silent_ns = round(silent_s * _NS_PER_S)
        self._info = EncoderInfo("encoders", tuple(channel.joint for channel in channels))
        self.stats = LinkStats()
        self._builder = SampleBuilder(channels, counting, self.stats)
        self._queue: deque[EncoderSample] = deque()
        self._failure: DriverError | None = None
        self._wakeup = Wakeup()
        self._open = False
        self._alive_ns = 0

    @property
    def info(self) -> EncoderInfo:
        """What is fixed while open.

        Raises:
            DeviceLost: The link is not open.
        """
        if not self._open:
            raise DeviceLost(f"{self._name}: the encoder link is not open")
        return self._info

    def vitals(self) -> DeviceVitals:
        """See `TellsVitals.vitals`."""
        return DeviceVitals(self.stats.refused())

    async def open(self) -> None:
        """Connect; harmless if already open.

        Raises:
            DeviceNotFound: No such port or bus, or its library is not installed.
        """
        if self._open:
            return
        self._queue.clear()
        self._failure = None
        self._builder = SampleBuilder(self._channels, self._counting, self.stats, self._builder.clock)
        self._alive_ns = self._clock.now_ns()
        self._open = True
        try:
            await self._connect()
        except BaseException:
            self._open = False
            raise
        self._alive_ns = self._clock.now_ns()

    async def read(self, timeout_s: float) -> EncoderSample:
        """Wait for the next sample not yet returned.

        Raises:
            ReadTimeout: Nothing new within `timeout_s`.
            DeviceLost: The link broke, was silent for too long, or is not open.
            EndOfStream: A finite source is through.
        """
        deadline_ns = self._clock.now_ns() + round(timeout_s * _NS_PER_S)
        while not self._queue:
            if not self._open:
                raise DeviceLost(f"{self._name}: the encoder link is not open")
            if self._failure is not None:
                raise self._failure
            now_ns = self._clock.now_ns()
            silent_until_ns = self._alive_ns + self._silent_ns
            if now_ns >= silent_until_ns:
                raise DeviceLost(
                    f"{self._name}: no valid encoder sample for {(now_ns - self._alive_ns) * 1e-9:.2f} s "
                    f"({self.stats.summary()}); check power and cable, and that the settings match what is sent"
                )
            if now_ns >= deadline_ns:
                raise ReadTimeout(f"{self._name}: no encoder sample within {timeout_s * 1000:.0f} ms")
            await self._wakeup.wait((min(deadline_ns, silent_until_ns) - now_ns) / _NS_PER_S)
        return self._queue.popleft()

    async def close(self) -> None:
        """Disconnect and release; harmless if not open; wakes a waiting `read`, which then raises DeviceLost."""
        if not self._open:
            return
        self._open = False
        self._queue.clear()
        self._wakeup.wake()
        await self._disconnect()

    @abstractmethod
    async def _connect(self) -> None:
        """Start receiving."""

    @abstractmethod
    async def _disconnect(self) -> None:
        """Stop receiving and release everything."""

    def _deliver(self, readings: Sequence[RawReading], t_arrival_ns: int, t_first_ns: int | None = None) -> None:
        """Queue what was received at one instant (its first part at `t_first_ns`); on the event loop's thread."""
        if not readings:
            return
        if len(readings) > 1 and not self._builder.places_bursts(readings[-1], t_arrival_ns):
            self.stats.rejected[Rejection.SUPERSEDED] += len(readings) - 1
            readings = readings[-1:]
        for reading in readings:
            sample = self._builder.build(reading, t_arrival_ns, t_first_ns)
            if sample is not None:
                self._alive_ns = t_arrival_ns
                self._queue.append(sample)
        while len(self._queue) > _QUEUE:
            self._queue.popleft()
            self.stats.rejected[Rejection.OVERRUN] += 1
        if self._queue:
            self._wakeup.wake()

    def _fail(self, error: DriverError) -> None:
        """Let `read` raise `error` once what was received before it has been read; on the event loop's thread."""
        if self._failure is None:
            self._failure = error
        self._wakeup.wake()
