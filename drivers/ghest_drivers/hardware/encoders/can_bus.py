"""Opening a CAN bus of python-can by settings, and receiving from it in a thread of our own.

python-can's own Notifier loses errors and may leave its reader waiting for ever; here every error reaches the event loop, and
the link's watch on silence covers the rest.
"""

import contextlib
import functools
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceLost, DeviceNotFound, DriverError
from ghest_drivers.hardware.encoders.handoff import Handoff
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection
from ghest_drivers.installing import pip_install

_POLL_S = 0.05
_NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class CanBusSettings:
    """How to reach the bus.

    Attributes:
        interface: python-can's name of it: socketcan, slcan, pcan, kvaser, vector, udp_multicast, virtual, …
        channel: Channel, in that interface's terms.
        bitrate: Bits per second; None where the interface needs none.
        options: Anything else that the interface takes, passed on as it is.
    """

    interface: str
    channel: str
    bitrate: int | None = None
    options: dict[str, str | int | float | bool] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """For messages."""
        return f"CAN bus {self.interface}:{self.channel}"


@dataclass(frozen=True, slots=True)
class CanFrame:
    """One data frame received.

    Attributes:
        frame_id: Arbitration id.
        data: 0 to 64 bytes.
        t_bus_ns: python-can's time stamp: the driver's or the controller's clock, by interface.
        t_arrival_ns: Host monotonic.
    """

    frame_id: int
    data: bytes
    t_bus_ns: int
    t_arrival_ns: int


def open_bus(settings: CanBusSettings) -> Any:
    """Open the bus; blocks.

    Raises:
        DeviceNotFound: python-can is not installed, or the bus cannot be opened.
    """
    try:
        import can  # noqa: PLC0415 - only where this backend is chosen
    except ImportError as error:
        raise DeviceNotFound(f"CAN encoders need python-can: {pip_install('can')}") from error
    options: dict[str, Any] = dict(settings.options)
    if settings.bitrate is not None:
        options["bitrate"] = settings.bitrate
    try:
        return can.Bus(interface=settings.interface, channel=settings.channel, **options)
    except Exception as error:  # interfaces raise what their vendor library raises
        raise DeviceNotFound(
            f"{settings.name}: cannot be opened: {error}; check encoders.device.bus in the station file, "
            "and that the interface is up (ip link) or its vendor's driver is installed"
        ) from error


class CanReceiver:
    """Owns an open bus: a thread receives, counts what is wrong, and hands data frames over.

    Args:
        name: For messages.
        bus: The open bus; closed by `stop`.
        clock: Host monotonic clock.
        stats: Where bad frames are counted.
        handoff: Takes the data frames.
        fail: Called on the event loop when the bus is lost.
        also: Called in the thread with every data frame, for protocols that answer on their own.
    """

    def __init__(
        self,
        name: str,
        bus: Any,
        clock: Clock,
        stats: LinkStats,
        *,
        handoff: Handoff[CanFrame],
        fail: Callable[[DriverError], None],
        also: Callable[[CanFrame], None] | None = None,
    ) -> None:
        self._name = name
        self._bus = bus
        self._clock = clock
        self._stats = stats
        self._handoff = handoff
        self._fail = fail
        self._also = also
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"encoders {name}", daemon=True)

    def start(self) -> None:
        """Begin to receive."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread and close the bus; blocks."""
        self._stop.set()
        self._thread.join(1.0)
        with contextlib.suppress(Exception):  # an unplugged adapter may refuse to close; there is nothing left to do
            self._bus.shutdown()

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                message = self._bus.recv(_POLL_S)
            except (ValueError, IndexError):  # slcan: a line that is no frame
                self._stats.rejected[Rejection.BAD_FRAME] += 1
                continue
            except Exception as error:  # whatever a vendor library raises, the link must not hang
                if not self._stop.is_set():
                    lost = DeviceLost(f"{self._name}: the bus is gone: {error}")
                    self._handoff.call(functools.partial(self._fail, lost))
                return
            if message is None:
                continue
            if message.is_error_frame:
                self._stats.rejected[Rejection.BAD_FRAME] += 1
                continue
            if message.is_remote_frame:
                continue
            t_arrival_ns = self._clock.now_ns()
            frame = CanFrame(message.arbitration_id, bytes(message.data), round(message.timestamp * _NS_PER_S), t_arrival_ns)
            if self._also is not None:
                self._also(frame)
            self._handoff.put(frame)
