"""The seams of the driver layer: what every backend (real, replay, sim) offers.

Cameras block, since vendor libraries do and the vision that follows belongs on that same thread, off the event loop.
Encoder links are asynchronous: they end in a file descriptor or a queue that the event loop can wait for.
"""

from typing import Protocol, runtime_checkable

from ghest_drivers.samples import CameraInfo, DeviceVitals, EncoderInfo, EncoderSample, RgbdFrame


@runtime_checkable
class TellsVitals(Protocol):
    """A camera or link that says how it is doing; optional."""

    def vitals(self) -> DeviceVitals:
        """Return what is known by now, at once and without asking the device; from any thread."""
        ...


@runtime_checkable
class RgbdCamera(Protocol):
    """A colour and depth camera. One thread at a time may call `read`."""

    @property
    def info(self) -> CameraInfo:
        """What is fixed while open.

        Raises:
            DeviceLost: The camera is not open.
        """
        ...

    def open(self) -> None:
        """Start streaming; harmless if already open.

        Raises:
            DeviceNotFound: No such device, or its library is not installed.
        """
        ...

    def read(self, timeout_s: float) -> RgbdFrame:
        """Block until the next frame not yet returned.

        Raises:
            ReadTimeout: Nothing new within `timeout_s`.
            DeviceLost: The device stopped answering, or the camera is not open.
            EndOfStream: A finite source is through.
            BadDeviceData: A frame of the wrong size, type or encoding.
        """
        ...

    def close(self) -> None:
        """Stop and release; harmless if not open; wakes a blocked `read`, which then raises DeviceLost."""
        ...


@runtime_checkable
class EncoderLink(Protocol):
    """The exoskeleton's joint encoders."""

    @property
    def info(self) -> EncoderInfo:
        """What is fixed while open.

        Raises:
            DeviceLost: The link is not open.
        """
        ...

    async def open(self) -> None:
        """Connect; harmless if already open.

        Raises:
            DeviceNotFound: No such port or bus, or its library is not installed.
        """
        ...

    async def read(self, timeout_s: float) -> EncoderSample:
        """Wait for the next sample not yet returned.

        Raises:
            ReadTimeout: Nothing new within `timeout_s`.
            DeviceLost: The link broke, or is not open.
            EndOfStream: A finite source is through.
        """
        ...

    async def close(self) -> None:
        """Disconnect and release; harmless if not open."""
        ...
