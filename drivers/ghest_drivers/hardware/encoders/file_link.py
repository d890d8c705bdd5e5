"""An encoder link that reads a file: Armeocontrol exports and CAN logs."""

from collections.abc import Callable, Iterator

from ghest_drivers.clock import Clock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DeviceNotFound, EndOfStream, ReadTimeout
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.stats import LinkStats
from ghest_drivers.hardware.encoders.wakeup import Wakeup
from ghest_drivers.samples import EncoderInfo, EncoderSample

_NS_PER_S = 1_000_000_000


class FileEncoderLink:
    """Delivers the samples of a file, shifted in time so that the first arrives when the link is opened.

    Args:
        name: The file, for messages.
        channels: The encoders, in the order of the angles delivered.
        samples: Opens the file and yields its samples; given the statistics to count refusals in. May raise OSError or
            BadDeviceData.
        clock: Host monotonic clock.
        paced: Deliver each sample when it is due; else at once.
    """

    def __init__(
        self,
        name: str,
        channels: tuple[Channel, ...],
        samples: Callable[[LinkStats], Iterator[EncoderSample]],
        clock: Clock,
        *,
        paced: bool = True,
    ) -> None:
        self._name = name
        self._info = EncoderInfo("encoders", tuple(channel.joint for channel in channels))
        self._samples = samples
        self._clock = clock
        self._paced = paced
        self.stats = LinkStats()
        self._source: Iterator[EncoderSample] | None = None
        self._next: EncoderSample | None = None
        self._end = "the end of the file"
        self._shift_ns = 0
        self._wakeup = Wakeup()

    @property
    def info(self) -> EncoderInfo:
        """What is fixed while open.

        Raises:
            DeviceLost: The link is not open.
        """
        if self._source is None:
            raise DeviceLost(f"{self._name}: the encoder link is not open")
        return self._info

    async def open(self) -> None:
        """Open the file, from its beginning; harmless if already open.

        Raises:
            DeviceNotFound: The file cannot be read, or holds no samples.
        """
        if self._source is not None:
            return
        source = self._samples(self.stats)
        try:
            self._next = next(source, None)
        except (OSError, BadDeviceData) as error:
            raise DeviceNotFound(f"{self._name}: cannot be read: {error}") from error
        if self._next is None:
            raise DeviceNotFound(f"{self._name}: holds no usable encoder samples ({self.stats.summary()})")
        self._shift_ns = self._clock.now_ns() - self._next.t_arrival_ns
        self._source = source

    async def read(self, timeout_s: float) -> EncoderSample:
        """Wait for the next sample.

        Raises:
            ReadTimeout: None is due within `timeout_s`.
            DeviceLost: The link is not open.
            EndOfStream: The file is through.
        """
        deadline_ns = self._clock.now_ns() + round(timeout_s * _NS_PER_S)
        while True:
            if self._source is None:
                raise DeviceLost(f"{self._name}: the encoder link is not open")
            if self._next is None:
                raise EndOfStream(f"{self._name}: {self._end}")
            now_ns = self._clock.now_ns()
            due_ns = self._next.t_arrival_ns + self._shift_ns
            if not self._paced or now_ns >= due_ns:
                return self._take(self._source, self._next)
            if now_ns >= deadline_ns:
                raise ReadTimeout(f"{self._name}: no encoder sample within {timeout_s * 1000:.0f} ms")
            await self._wakeup.wait((min(due_ns, deadline_ns) - now_ns) / _NS_PER_S)

    async def close(self) -> None:
        """Close the file; harmless if not open; wakes a waiting `read`, which then raises DeviceLost."""
        self._source = None
        self._next = None
        self._wakeup.wake()

    def _take(self, source: Iterator[EncoderSample], sample: EncoderSample) -> EncoderSample:
        try:
            self._next = next(source, None)
        except (OSError, BadDeviceData) as error:  # used up to the damage, which is then told
            self._next = None
            self._end = f"damaged: {error}"
        return EncoderSample(
            sample.seq,
            sample.angles_rad,
            sample.t_device_ns,
            sample.t_arrival_ns + self._shift_ns,
            sample.t_capture_ns + self._shift_ns,
        )
