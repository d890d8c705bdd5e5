"""Encoders on a serial line: a port, a pseudo-terminal, or any URL of pyserial (`socket://`, `rfc2217://`, …)."""

import asyncio
import contextlib
import errno
import functools
import os
import threading
from collections import deque
from dataclasses import dataclass
from typing import Any, Protocol

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceLost, DeviceNotFound
from ghest_drivers.hardware.encoders.binary_frame import BinaryFormat, BinaryFrameDecoder
from ghest_drivers.hardware.encoders.builder import Counting
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.handoff import Handoff
from ghest_drivers.hardware.encoders.link import SampleQueueLink
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.text_line import TextFormat, TextLineDecoder
from ghest_drivers.installing import pip_install

_READ_BYTES = 65536
_POLL_S = 0.05
_REMEDIES = {
    errno.ENOENT: "is the converter plugged in? `ghest-rt doctor` lists the ports",
    errno.EACCES: "the user must be in the group that owns the port, usually dialout",
    errno.EBUSY: "another program has it open",
    errno.EAGAIN: "another program has it open",
}


class Decoder(Protocol):
    """Bytes to raw readings."""

    def feed(self, data: bytes) -> list[RawReading]:
        """Return the readings that `data` completes."""
        ...


@dataclass(frozen=True, slots=True)
class SerialSettings:
    """A serial encoder link.

    Attributes:
        port: Device path or URL.
        layout: What is sent.
        channels: The encoders, in the order of the angles delivered.
        baud: Bits per second.
        time_tick_ns: One tick of the field "time".
        latency_ns: Least delay between latch and arrival.
        fault_mask: Bits of the field "status" that mean that the angles are not to be trusted.
        silent_s: Longest time without an acceptable sample before the link counts as lost.
    """

    port: str
    layout: BinaryFormat | TextFormat
    channels: tuple[Channel, ...]
    baud: int = 115200
    time_tick_ns: int = 1000
    latency_ns: int = 0
    fault_mask: int = -1
    silent_s: float = 1.0

    @property
    def counting(self) -> Counting:
        """How the device counts samples and time."""
        names = self.layout.fields if isinstance(self.layout, TextFormat) else tuple(name for name, _ in self.layout.fields)
        if isinstance(self.layout, TextFormat):
            seq_modulus, wrap_ticks = self.layout.seq_modulus, self.layout.time_modulus
        else:
            seq_modulus, wrap_ticks = self.layout.modulus("seq") or 1, self.layout.modulus("time")
        return Counting(
            seq_modulus if "seq" in names else None,
            self.time_tick_ns if "time" in names else None,
            wrap_ticks,
            self.latency_ns,
            self.fault_mask,
        )


class SerialEncoderLink(SampleQueueLink):
    """`EncoderLink` over pyserial. Where the port has a file descriptor the event loop waits on it; else a thread reads."""

    def __init__(self, settings: SerialSettings, clock: Clock) -> None:
        super().__init__(settings.port, settings.channels, settings.counting, clock, silent_s=settings.silent_s)
        self._settings = settings
        self._decoder = self._new_decoder()
        self._serial: Any = None
        self._fd: int | None = None
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()

    async def _connect(self) -> None:
        loop = asyncio.get_running_loop()
        self._decoder = self._new_decoder()
        self._serial = await asyncio.to_thread(self._open_port)
        self._fd = _descriptor(self._serial)
        if self._fd is not None:
            loop.add_reader(self._fd, self._readable)
            return
        self._stop.clear()
        handoff = Handoff(loop, self._handed_over, self.stats)
        self._thread = threading.Thread(target=self._receive, args=(handoff,), name=f"encoders {self._name}", daemon=True)
        self._thread.start()

    async def _disconnect(self) -> None:
        self._unwatch()
        self._stop.set()
        if self._thread is not None:
            await asyncio.to_thread(self._thread.join, 1.0)
            self._thread = None
        port, self._serial = self._serial, None
        if port is not None:
            await asyncio.to_thread(_close_quietly, port)

    def _new_decoder(self) -> Decoder:
        layout = self._settings.layout
        sources = [channel.source for channel in self._channels]
        if isinstance(layout, TextFormat):
            return TextLineDecoder(layout, sources, self.stats)
        return BinaryFrameDecoder(layout, sources, self.stats)

    def _open_port(self) -> Any:
        try:
            import serial  # noqa: PLC0415 - only where this backend is chosen
        except ImportError as error:
            raise DeviceNotFound(f"the serial encoder link needs pyserial: {pip_install('serial')}") from error
        options: dict[str, Any] = {} if "://" in self._settings.port else {"exclusive": True}
        try:
            port = serial.serial_for_url(self._settings.port, baudrate=self._settings.baud, timeout=_POLL_S, **options)
        except (serial.SerialException, OSError, ValueError) as error:
            remedy = _REMEDIES.get(getattr(error, "errno", None) or 0, "check encoders.device.port in the station file")
            raise DeviceNotFound(f"{self._settings.port}: cannot open the encoder port: {error}; {remedy}") from error
        # Adapters without the low-latency flag, pseudo-terminals and network ports refuse it, and work all the same.
        with contextlib.suppress(ValueError, OSError, AttributeError, NotImplementedError):
            port.set_low_latency_mode(True)
        with contextlib.suppress(serial.SerialException, OSError):
            port.reset_input_buffer()  # what waited before now is old
        return port

    def _readable(self) -> None:
        if self._fd is None:
            return
        try:
            data = os.read(self._fd, _READ_BYTES)
        except BlockingIOError:
            return
        except OSError as error:
            self._broken(str(error))
            return
        t_arrival_ns = self._clock.now_ns()
        if not data:
            self._broken("the far end closed the line")
            return
        self._deliver(self._decoder.feed(data), t_arrival_ns)

    def _broken(self, reason: str) -> None:
        self._unwatch()
        self._fail(DeviceLost(f"{self._name}: the encoder port is gone: {reason}"))

    def _unwatch(self) -> None:
        if self._fd is not None:
            asyncio.get_running_loop().remove_reader(self._fd)
            self._fd = None

    def _receive(self, handoff: Handoff[tuple[bytes, int]]) -> None:
        port = self._serial
        while not self._stop.is_set():
            try:
                data = port.read(max(1, min(port.in_waiting, _READ_BYTES)))
            except Exception as error:  # whatever a protocol handler raises, the link must not hang
                handoff.call(functools.partial(self._broken, str(error)))
                return
            if data:
                handoff.put((bytes(data), self._clock.now_ns()))

    def _handed_over(self, chunks: deque[tuple[bytes, int]]) -> None:
        for data, t_arrival_ns in chunks:
            self._deliver(self._decoder.feed(data), t_arrival_ns)


def _descriptor(port: Any) -> int | None:
    """Return the descriptor that the event loop can wait on, if the port has one."""
    try:
        fd = int(port.fileno())
        os.set_blocking(fd, False)
    except (OSError, AttributeError, ValueError):  # io.UnsupportedOperation is both an OSError and a ValueError
        return None
    return fd


def _close_quietly(port: Any) -> None:
    with contextlib.suppress(Exception):  # a port that was unplugged may refuse to close; there is nothing left to do
        port.close()
