"""The hardware encoder links as the contract suite of tests/drivers wants them: streaming, or silent after one sample."""

import asyncio
import os
import pty
import tempfile
import threading
import tty
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import can

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.hardware.encoders.armeo_export import ArmeoSettings, armeo_link
from ghest_drivers.hardware.encoders.binary_frame import DOCUMENTED_RAD_PER_COUNT, documented_format
from ghest_drivers.hardware.encoders.can_bus import CanBusSettings
from ghest_drivers.hardware.encoders.can_link import CanEncoderLink, CanSettings
from ghest_drivers.hardware.encoders.canopen_link import CanopenEncoderLink, CanopenSettings
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.serial_link import SerialEncoderLink, SerialSettings
from ghest_drivers.interfaces import EncoderLink
from tests.hardware_encoders.can_senders import ARMEO_CHANNELS, ARMEO_LAYOUT, armeo_frames
from tests.hardware_encoders.canopen_senders import NODES, Encoders

_PERIOD_S = 0.004
_SILENT_S = 60.0


class Sender:
    """Calls `send(k)` every four milliseconds in a thread, or never."""

    def __init__(self, send: Callable[[int], None], silent: bool) -> None:
        self._send = send
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        if not silent:
            self._thread.start()

    def _run(self) -> None:
        k = 0
        while not self._stop.wait(_PERIOD_S):
            self._send(k)
            k += 1

    async def stop(self) -> None:
        self._stop.set()
        if self._thread.ident is not None:
            await asyncio.to_thread(self._thread.join)


@asynccontextmanager
async def serial_encoders(silent: bool) -> AsyncIterator[EncoderLink]:
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    layout = documented_format(2)
    channels = tuple(Channel(f"j{k}", f"a{k}", rad_per_count=DOCUMENTED_RAD_PER_COUNT) for k in range(2))

    def send(k: int) -> None:
        with suppress(BlockingIOError):  # nobody reads
            os.write(master, layout.encode({"seq": k, "time": k * 4000, "a0": 10 * k}))

    sender = Sender(send, silent)
    settings = SerialSettings(os.ttyname(slave), layout, channels, silent_s=_SILENT_S)
    yield SerialEncoderLink(settings, MonotonicClock())
    await sender.stop()
    os.close(slave)
    os.close(master)


@asynccontextmanager
async def can_encoders(silent: bool) -> AsyncIterator[EncoderLink]:
    bus = can.Bus(interface="virtual", channel="contract")

    def send(k: int) -> None:
        for frame in armeo_frames(k, k * 4_000_000, [0.01 * k] * 7):
            bus.send(frame)

    sender = Sender(send, silent)
    settings = CanSettings(CanBusSettings("virtual", "contract"), ARMEO_LAYOUT, ARMEO_CHANNELS, silent_s=_SILENT_S)
    yield CanEncoderLink(settings, MonotonicClock())
    await sender.stop()
    bus.shutdown()


@asynccontextmanager
async def canopen_encoders(silent: bool) -> AsyncIterator[EncoderLink]:
    far_side = Encoders("contract canopen")
    if silent:
        far_side.silent.update(NODES)
    channels = tuple(Channel(f"j{node}", str(node), rad_per_count=1e-4) for node in NODES)
    bus = CanBusSettings("virtual", "contract canopen")
    yield CanopenEncoderLink(CanopenSettings(bus, channels, silent_s=_SILENT_S), MonotonicClock())
    far_side.close()


@asynccontextmanager
async def armeo_encoders(silent: bool) -> AsyncIterator[EncoderLink]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "export.csv"
        minute = 1 if silent else 0
        rows = [f"12:{k * minute:02}:00.{k * 4 * (1 - minute):03}; {k}.5; 1.0;" for k in range(8)]
        path.write_text("Timestamp; Elbow; Forearm\n" + "\n".join(rows), encoding="utf-8")
        yield armeo_link(ArmeoSettings(path, (Channel("j4", "Elbow"), Channel("j6", "Forearm"))), MonotonicClock())
