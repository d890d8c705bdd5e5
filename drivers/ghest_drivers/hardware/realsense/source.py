"""Where the frames come from: a connected device, or a .bag file."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.hardware.realsense.devices import find_device, reset_device
from ghest_drivers.hardware.realsense.timestamps import RecordedClock, StreamClock


class Source(Protocol):
    """Gives the camera an SDK device and clocks that fit it."""

    @property
    def lossless(self) -> bool:
        """Whether frames wait for the reader."""
        ...

    @property
    def finite(self) -> bool:
        """Whether the frames end by themselves."""
        ...

    def acquire(self, context: Any) -> Any:
        """Return the SDK device, found through this SDK context.

        Raises:
            DeviceNotFound: There is none.
        """
        ...

    def stream_clock(self, period_ns: int) -> StreamClock | RecordedClock:
        """Return a new clock map for one stream."""
        ...

    def reset(self, context: Any, clock: Clock) -> None:
        """Bring the device to its initial state, where that is possible."""
        ...

    def release(self, context: Any) -> None:
        """Undo `acquire`; the streams have stopped."""
        ...


class ConnectedDevice:
    """A device on a USB port, chosen by serial number."""

    lossless = False
    finite = False

    def __init__(self, serial: str, latency_ns: int | None, unix_ns: Callable[[], int]) -> None:
        self._serial = serial
        self._latency_ns = latency_ns
        self._unix_ns = unix_ns

    def acquire(self, context: Any) -> Any:
        """Query first: starting a device that is absent blocks for 15 s."""
        return find_device(context, self._serial)

    def stream_clock(self, period_ns: int) -> StreamClock:
        """Return a map from the device's clock."""
        return StreamClock(period_ns if self._latency_ns is None else self._latency_ns, self._unix_ns)

    def reset(self, context: Any, clock: Clock) -> None:
        """Reset the hardware and wait until it is back."""
        reset_device(context, self._serial, clock)

    def release(self, context: Any) -> None:
        """Nothing to do: the device goes with its last reference."""


class BagFile:
    """A recording of the SDK's own recorder.

    Args:
        path: The file.
        real_time: Play at the recorded pace, as if live; otherwise as fast as it is read, losing nothing, with the
            recorded times as capture times.
    """

    finite = True

    def __init__(self, path: Path, *, real_time: bool = True) -> None:
        self._path = path
        self._real_time = real_time
        self.lossless = not real_time

    def acquire(self, context: Any) -> Any:
        """Load the file.

        Raises:
            DeviceNotFound: It is missing, or no recording.
        """
        if not self._path.is_file():
            raise DeviceNotFound(f"there is no recording {self._path}")
        try:
            device = context.load_device(str(self._path))
        except RuntimeError as error:
            raise DeviceNotFound(f"{self._path} is not a complete RealSense recording: {error}") from error
        device.set_real_time(self._real_time)
        return device

    def stream_clock(self, period_ns: int) -> StreamClock | RecordedClock:
        """Return a map from the recorded clock."""
        return StreamClock(0, None) if self._real_time else RecordedClock()

    def reset(self, context: Any, clock: Clock) -> None:
        """Nothing to do."""

    def release(self, context: Any) -> None:
        """Take the file out of the context, which would keep it open."""
        context.unload_device(str(self._path))
