"""The serial link over a pseudo-terminal, a socket and RFC 2217, with what goes wrong on the way."""

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
import serial
import serial.rfc2217

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import DeviceLost, DeviceNotFound, ReadTimeout
from ghest_drivers.hardware.encoders.binary_frame import BinaryFormat, documented_format
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.serial_link import SerialEncoderLink, SerialSettings
from ghest_drivers.hardware.encoders.stats import Rejection
from ghest_drivers.hardware.encoders.text_line import TextFormat
from ghest_drivers.interfaces import EncoderLink
from tests.hardware_encoders.conftest import PtyPair

LAYOUT = documented_format(3)


def frame(seq: int, **values: float) -> bytes:
    """A frame at 1 kHz whose first angle is a tenth of a degree per sample."""
    return LAYOUT.encode({"seq": seq, "time": seq * 1000, "a0": seq * 1000, "a1": 100_000, **values})


async def opened(settings: SerialSettings) -> SerialEncoderLink:
    link = SerialEncoderLink(settings, MonotonicClock())
    await link.open()
    return link


async def test_samples_come_through_with_angles_times_and_sequence(pty_pair: PtyPair, serial_settings: SerialSettings) -> None:
    link = await opened(serial_settings)
    assert isinstance(link, EncoderLink)
    assert link.info.joint_names == ("j0", "j1", "j2")
    previous = None
    for seq in (1, 2, 4):
        pty_pair.send(frame(seq, a1=90_000, a2=-5))
        sample = await link.read(1.0)
        assert sample.angles_rad == pytest.approx(np.radians([seq * 0.1, 1.0, -0.0005]))
        assert sample.t_device_ns == seq * 1_000_000
        assert sample.t_capture_ns <= sample.t_arrival_ns
        if previous is not None:
            assert sample.t_capture_ns > previous.t_capture_ns
            assert sample.seq - previous.seq == (seq + 1) // 2
        previous = sample
    assert link.stats.lost == 1
    await link.close()


async def test_what_waited_before_opening_is_not_passed_on(pty_pair: PtyPair, serial_settings: SerialSettings) -> None:
    pty_pair.send(frame(1) + frame(2))
    link = await opened(serial_settings)
    pty_pair.send(frame(3))
    assert (await link.read(1.0)).t_device_ns == 3_000_000
    await link.close()


async def test_garbage_between_frames_is_discarded_and_counted(pty_pair: PtyPair, serial_settings: SerialSettings) -> None:
    link = await opened(serial_settings)
    corrupt = bytearray(frame(2))
    corrupt[12] ^= 1
    pty_pair.send(frame(0)[7:] + frame(0))
    assert (await link.read(1.0)).t_device_ns == 0
    await asyncio.sleep(0.01)  # the device's clock runs on meanwhile
    pty_pair.send(frame(1) + bytes(corrupt) + b"\xa5\x5a\xa5" + frame(3))
    assert [(await link.read(1.0)).t_device_ns for _ in range(2)] == [1_000_000, 3_000_000]
    assert link.stats.rejected[Rejection.BAD_CHECKSUM] >= 1
    assert link.stats.lost == 1
    await link.close()


async def test_a_burst_of_old_samples_after_reopening_is_placed_in_the_past(
    pty_pair: PtyPair, serial_settings: SerialSettings
) -> None:
    link = await opened(serial_settings)
    start_ns = time.monotonic_ns()
    for seq in range(3):
        pty_pair.send(frame(seq))
        offset_ns = (await link.read(1.0)).t_capture_ns - seq * 1_000_000
        await asyncio.sleep(0.001)
    await link.close()
    await link.open()
    await asyncio.sleep(0.1)
    for first in (10, 12):  # 10 .. 14 ms by the device's clock: what it had kept for us
        pty_pair.send(frame(first) + frame(first + 1))
        for seq in (first, first + 1):
            sample = await link.read(1.0)
            assert abs(sample.t_capture_ns - seq * 1_000_000 - offset_ns) < 5_000_000
            assert sample.t_arrival_ns - start_ns > 100_000_000
    await link.close()


async def test_implausible_angles_are_not_passed_on(pty_pair: PtyPair, serial_settings: SerialSettings) -> None:
    link = await opened(serial_settings)
    pty_pair.send(frame(0))
    assert (await link.read(1.0)).t_device_ns == 0
    await asyncio.sleep(0.01)  # the device's clock runs on meanwhile
    pty_pair.send(frame(1) + frame(2, a0=1_500_000) + frame(3, a0=400_000) + frame(4, status=1) + frame(5))
    assert [(await link.read(1.0)).t_device_ns for _ in range(2)] == [1_000_000, 5_000_000]
    assert link.stats.rejected == {Rejection.OUT_OF_RANGE: 1, Rejection.TOO_FAST: 1, Rejection.DEVICE_FAULT: 1}
    await link.close()


async def test_text_lines(pty_pair: PtyPair, channels: tuple[Channel, ...], serial_settings: SerialSettings) -> None:
    layout = TextFormat(("seq", "a0", "a1", "a2"), checksum="xor8")
    link = await opened(replace(serial_settings, layout=layout))
    pty_pair.send(b"half a line\n" + layout.encode({"seq": 5, "a0": 10_000, "a1": 100_000, "a2": 0}))
    sample = await link.read(1.0)
    assert sample.angles_rad == pytest.approx([np.radians(1.0), 0.0, 0.0])
    assert sample.t_capture_ns == sample.t_arrival_ns
    await link.close()


async def test_without_device_time_only_the_last_of_a_burst_is_placed_in_time(
    pty_pair: PtyPair, serial_settings: SerialSettings
) -> None:
    layout = BinaryFormat(b"\xa5", (("seq", "u8"), ("a0", "i32"), ("a1", "i32"), ("a2", "i32")))
    link = await opened(replace(serial_settings, layout=layout))
    pty_pair.send(b"".join(layout.encode({"seq": seq, "a0": seq, "a1": 100_000}) for seq in (1, 2, 3)))
    sample = await link.read(1.0)
    assert sample.angles_rad[0] == pytest.approx(np.radians(3e-4))
    assert link.stats.rejected == {Rejection.SUPERSEDED: 2}
    await link.close()


async def test_silence_is_a_timeout_then_a_loss(pty_pair: PtyPair, serial_settings: SerialSettings) -> None:
    link = await opened(replace(serial_settings, silent_s=0.2))
    with pytest.raises(ReadTimeout):
        await link.read(0.01)
    pty_pair.send(bytes(1000))  # noise is no sign of life
    with pytest.raises(DeviceLost, match=r"no valid encoder sample for .* 1000 bytes discarded"):
        await link.read(5.0)
    await link.close()


async def test_an_unplugged_converter_is_a_loss_after_what_it_sent(pty_pair: PtyPair, serial_settings: SerialSettings) -> None:
    link = await opened(serial_settings)
    pty_pair.send(frame(1))
    await link.read(1.0)
    pty_pair.hang_up()
    with pytest.raises(DeviceLost, match="gone"):
        await link.read(1.0)
    await link.close()


async def test_it_can_be_opened_again(pty_pair: PtyPair, serial_settings: SerialSettings) -> None:
    link = SerialEncoderLink(serial_settings, MonotonicClock())
    for seq in (1, 1, 1):  # the same frame again is no duplicate on a new connection
        await link.open()
        await link.open()
        pty_pair.send(frame(seq))
        await link.read(1.0)
        await link.close()
        await link.close()
    with pytest.raises(DeviceLost, match="not open"):
        await link.read(0.1)
    with pytest.raises(DeviceLost, match="not open"):
        _ = link.info


async def test_closing_wakes_a_waiting_read(serial_settings: SerialSettings) -> None:
    link = await opened(serial_settings)
    waiting = asyncio.create_task(link.read(10.0))
    await asyncio.sleep(0.01)
    await link.close()
    with pytest.raises(DeviceLost, match="not open"):
        await waiting


async def test_ports_that_cannot_be_opened_are_named_with_a_remedy(serial_settings: SerialSettings, pty_pair: PtyPair) -> None:
    for port, message in (
        ("/dev/does-not-exist", "/dev/does-not-exist: .*plugged in"),
        ("socket://127.0.0.1:1", "socket://127.0.0.1:1: cannot open"),
        ("nonsense://x", "nonsense"),
    ):
        with pytest.raises(DeviceNotFound, match=message):
            await opened(replace(serial_settings, port=port))
    link = await opened(serial_settings)
    with pytest.raises(DeviceNotFound, match="another program has it open"):
        await opened(serial_settings)
    await link.close()


@contextmanager
def server(handle: Callable[[socket.socket], None]) -> Iterator[int]:
    """A TCP server on loopback that calls `handle(connection)` in a thread."""
    listener = socket.create_server(("127.0.0.1", 0))

    def run() -> None:
        connection, _ = listener.accept()
        with connection:
            handle(connection)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield listener.getsockname()[1]
    finally:
        thread.join(5)
        listener.close()


async def test_over_a_socket(serial_settings: SerialSettings) -> None:
    def handle(connection: socket.socket) -> None:
        connection.sendall(frame(0))
        for seq in range(1, 20):
            connection.sendall(frame(seq))
            threading.Event().wait(0.005)

    with server(handle) as port:
        link = await opened(replace(serial_settings, port=f"socket://127.0.0.1:{port}"))
        times = [(await link.read(1.0)).t_device_ns for _ in range(15)]
        assert times == sorted(set(times))
        with pytest.raises(DeviceLost, match="closed the line"):
            while True:
                await link.read(1.0)
        await link.close()


@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # within pyserial
async def test_over_rfc_2217(serial_settings: SerialSettings) -> None:
    stop = threading.Event()

    class Writer:
        def __init__(self, connection: socket.socket) -> None:
            self.connection = connection

        def write(self, data: bytes) -> None:
            self.connection.sendall(data)

    def handle(connection: socket.socket) -> None:
        connection.settimeout(0.005)
        port = serial.serial_for_url("loop://")
        manager = serial.rfc2217.PortManager(port, Writer(connection))
        seq = 0
        while not stop.is_set():
            try:
                data = connection.recv(1024)
            except TimeoutError:
                data = b""
            else:
                if not data:
                    break
            list(manager.filter(data))
            seq += 1
            connection.sendall(b"".join(manager.escape(frame(seq))))
        port.close()

    with server(handle) as port:
        try:
            link = await opened(replace(serial_settings, port=f"rfc2217://127.0.0.1:{port}"))
            times = [(await link.read(2.0)).t_device_ns for _ in range(10)]
            assert times == sorted(set(times))
            await link.close()
        finally:
            stop.set()
