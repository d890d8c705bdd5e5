"""The CAN link on the virtual bus, over slcan on a pseudo-terminal, over UDP multicast, and from logs."""

import asyncio
import os
import struct
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import can
import numpy as np
import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DeviceNotFound, EndOfStream, ReadTimeout
from ghest_drivers.hardware.encoders.can_bus import CanBusSettings
from ghest_drivers.hardware.encoders.can_layout import CanLayout
from ghest_drivers.hardware.encoders.can_link import CanEncoderLink, CanSettings
from ghest_drivers.hardware.encoders.can_log import CanLogSettings, can_log_link
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.stats import Rejection
from ghest_drivers.interfaces import EncoderLink
from tests.hardware_encoders.can_senders import ARMEO_CHANNELS, ARMEO_LAYOUT, ODRIVE_DBC, armeo_frames
from tests.hardware_encoders.conftest import PtyPair

MS = 1_000_000


def angles(seq: int) -> list[float]:
    return [round(0.1 * seq + joint, 2) for joint in range(7)]


def settings(bus: CanBusSettings, silent_s: float = 5.0) -> CanSettings:
    return CanSettings(bus, ARMEO_LAYOUT, ARMEO_CHANNELS, silent_s=silent_s)


@asynccontextmanager
async def virtual(request_name: str, silent_s: float = 5.0) -> AsyncIterator[tuple[CanEncoderLink, can.BusABC]]:
    bus = can.Bus(interface="virtual", channel=request_name)
    link = CanEncoderLink(settings(CanBusSettings("virtual", request_name), silent_s), MonotonicClock())
    await link.open()
    try:
        yield link, bus
    finally:
        await link.close()
        bus.shutdown()


def send(bus: can.BusABC, seq: int, status: int = 0) -> None:
    for frame in armeo_frames(seq, seq * MS, angles(seq), status):
        bus.send(frame)


async def test_samples_come_through_the_virtual_bus() -> None:
    async with virtual("through") as (link, bus):
        assert isinstance(link, EncoderLink)
        assert link.info.joint_names == tuple(f"j{k}" for k in range(7))
        last_ns = 0
        for seq in (1, 2, 3, 4):
            send(bus, seq)
            sample = await link.read(1.0)
            assert sample.angles_rad == pytest.approx(np.radians(angles(seq)))
            assert last_ns < sample.t_capture_ns <= sample.t_arrival_ns
            assert sample.t_device_ns == seq * MS
            last_ns = sample.t_capture_ns
            await asyncio.sleep(0.002)
        bus.send(can.Message(arbitration_id=0x7FF, data=b"\x01"))
        with pytest.raises(ReadTimeout):
            await link.read(0.05)


async def test_faults_are_refused_and_counted() -> None:
    async with virtual("faults") as (link, bus):
        send(bus, 0)
        await link.read(1.0)
        await asyncio.sleep(0.01)
        bus.send(armeo_frames(1, MS, angles(1))[0])
        send(bus, 2, status=1)
        bus.send(can.Message(is_error_frame=True))
        send(bus, 3)
        assert (await link.read(1.0)).t_device_ns == 3 * MS
        assert link.stats.rejected == {Rejection.INCOMPLETE: 1, Rejection.DEVICE_FAULT: 1, Rejection.BAD_FRAME: 1}
        assert link.stats.lost == 1


async def test_a_silent_bus_is_a_loss_although_others_talk_on_it() -> None:
    async with virtual("silent", silent_s=0.2) as (link, bus):
        bus.send(armeo_frames(1, MS, angles(1))[0])
        with pytest.raises(DeviceLost, match="no valid encoder sample"):
            await link.read(5.0)


async def test_closing_wakes_a_waiting_read_and_it_opens_again() -> None:
    async with virtual("again") as (link, bus):
        waiting = asyncio.create_task(link.read(10.0))
        await asyncio.sleep(0.01)
        await link.close()
        with pytest.raises(DeviceLost, match="not open"):
            await waiting
        await link.open()
        await link.open()
        send(bus, 1)
        await link.read(1.0)


async def test_an_error_of_the_bus_reaches_the_reader(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_bus: can.BusABC, timeout: float | None = None) -> can.Message | None:
        raise can.CanOperationError("bus off")

    monkeypatch.setattr(can.BusABC, "recv", broken)
    async with virtual("broken") as (link, _bus):
        with pytest.raises(DeviceLost, match="bus off"):
            await link.read(5.0)


@pytest.mark.parametrize("bus", [CanBusSettings("no-such-interface", "x"), CanBusSettings("slcan", "/dev/does-not-exist")])
async def test_buses_that_cannot_be_opened_are_named(bus: CanBusSettings) -> None:
    link = CanEncoderLink(settings(bus), MonotonicClock())
    with pytest.raises(DeviceNotFound, match=f"{bus.interface}:{bus.channel}: cannot be opened"):
        await link.open()
    with pytest.raises(DeviceLost):
        _ = link.info


async def test_over_slcan_on_a_pseudo_terminal(pty_pair: PtyPair) -> None:
    """The far side speaks the LAWICEL protocol: it confirms commands with CR and sends frames as text."""
    stop, garbage = threading.Event(), threading.Event()

    def adapter() -> None:
        os.set_blocking(pty_pair.master, False)
        seq, is_open = 0, False
        while not stop.wait(0.005):
            try:
                commands = os.read(pty_pair.master, 1024).split(b"\r")
            except BlockingIOError:
                commands = []
            for command in commands[:-1]:
                is_open = command.startswith(b"O") or (is_open and not command.startswith(b"C"))
                os.write(pty_pair.master, b"\r")
            if is_open:
                seq += 1
                for frame in armeo_frames(seq, seq * 5 * MS, angles(seq)):
                    os.write(pty_pair.master, f"t{frame.arbitration_id:03X}8{frame.data.hex()}\r".encode())
                if garbage.is_set():
                    os.write(pty_pair.master, b"\xff\xfe\r")
                if seq == 5:
                    os.write(pty_pair.master, b"t1zz\r\a")

    thread = threading.Thread(target=adapter)
    thread.start()
    bus = CanBusSettings("slcan", pty_pair.port, bitrate=500_000, options={"sleep_after_open": 0.01})
    link = CanEncoderLink(settings(bus), MonotonicClock())
    try:
        await link.open()
        for _ in range(20):
            sample = await link.read(1.0)
            assert sample.angles_rad == pytest.approx(np.radians(angles(sample.t_device_ns // (5 * MS))))
        assert link.stats.rejected[Rejection.BAD_FRAME] >= 1
        garbage.set()  # python-can cannot get back into step by itself: the link must be opened again
        with pytest.raises(DeviceLost, match="bus is gone"):
            while True:
                await link.read(1.0)
        garbage.clear()
        await link.close()
        await link.open()
        await link.read(1.0)
    finally:
        await link.close()
        stop.set()
        thread.join()


async def test_over_udp_multicast_on_loopback() -> None:
    pytest.importorskip("msgpack", reason="python-can needs msgpack for udp_multicast")
    options: dict[str, str | int | float | bool] = {"port": 43_217, "hop_limit": 0}
    bus_settings = CanBusSettings("udp_multicast", "239.74.163.2", options=options)
    link = CanEncoderLink(settings(bus_settings), MonotonicClock())
    try:
        await link.open()
        sender = can.Bus(interface="udp_multicast", channel="239.74.163.2", port=43_217, hop_limit=0)
    except (DeviceNotFound, OSError, can.CanError) as error:
        pytest.skip(f"no multicast on this machine: {error}")
    try:
        for seq in range(1, 5):
            send(sender, seq)
            assert (await link.read(2.0)).angles_rad == pytest.approx(np.radians(angles(seq)))
            await asyncio.sleep(0.002)
    except (can.CanError, OSError) as error:
        pytest.skip(f"no multicast on this machine: {error}")
    finally:
        sender.shutdown()
        await link.close()


async def test_odrive_axes_are_placed_in_time_by_the_bus() -> None:
    channels = tuple(
        Channel(f"j{axis}", f"Axis0_Get_Encoder_Estimates.Pos_Estimate@{axis << 5 | 9}", rad_per_count=2 * np.pi)
        for axis in range(3)
    )
    bus = can.Bus(interface="virtual", channel="odrive")
    link = CanEncoderLink(CanSettings(CanBusSettings("virtual", "odrive"), CanLayout(ODRIVE_DBC), channels), MonotonicClock())
    await link.open()
    for turns in (0.1, 0.2, 0.3):
        for axis in range(3):
            data = struct.pack("<ff", turns + axis, 0.0)
            bus.send(can.Message(arbitration_id=axis << 5 | 9, data=data, is_extended_id=False))
        sample = await link.read(1.0)
        assert sample.angles_rad == pytest.approx([2 * np.pi * (turns + axis) for axis in range(3)], abs=1e-6)
        assert sample.t_capture_ns <= sample.t_arrival_ns
        await asyncio.sleep(0.002)
    await link.close()
    bus.shutdown()


@pytest.mark.parametrize("suffix", [".asc", ".blf", ".log", ".csv"])
async def test_from_a_log(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"bus{suffix}"
    with can.Logger(path) as writer:
        for seq in range(20):
            for k, frame in enumerate(armeo_frames(seq, seq * 15 * MS, angles(seq))):
                frame.timestamp = 1_000.0 + seq * 0.015 + k * 0.0002
                if seq != 7 or k != 1:
                    writer.on_message_received(frame)
    link = can_log_link(CanLogSettings(path, ARMEO_LAYOUT, ARMEO_CHANNELS, paced=False), MonotonicClock())
    await link.open()
    samples = []
    with pytest.raises(EndOfStream):
        while True:
            samples.append(await link.read(1.0))
    await link.close()
    assert [round(sample.t_device_ns / (15 * MS)) for sample in samples] == [seq for seq in range(20) if seq != 7]
    captures = np.array([sample.t_capture_ns for sample in samples])
    assert np.diff(np.delete(captures, slice(7, None))) == pytest.approx(15 * MS, abs=0.1 * MS)
    assert link.stats.rejected == {Rejection.INCOMPLETE: 1}
    assert samples[3].angles_rad == pytest.approx(np.radians(angles(3)))


@pytest.mark.parametrize(("name", "content"), [("bus.blf", b"not a log"), ("bus.xyz", b""), ("bus.asc", b"")])
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # python-can leaves the file open
async def test_files_that_are_no_logs_are_refused(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    link = can_log_link(CanLogSettings(path, ARMEO_LAYOUT, ARMEO_CHANNELS), MonotonicClock())
    with pytest.raises(DeviceNotFound, match=name):
        await link.open()


def test_a_bad_layout_is_told_when_the_link_is_made() -> None:
    with pytest.raises(BadDeviceData, match="not in the DBC"):
        CanEncoderLink(
            CanSettings(CanBusSettings("virtual", "x"), ARMEO_LAYOUT, (Channel("j", "No.Signal"),)), MonotonicClock()
        )
