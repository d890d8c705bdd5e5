"""The encoder path at 1 kHz: lost samples, latency, error of the capture times, and the cost of decoding one sample.

Over a pseudo-terminal with the sender in another process, and over python-can's virtual bus, which lives in one process,
with the sender in a thread: `python -m benchmarks.encoder_path [--seconds 60]` from the project's root.
"""

import argparse
import asyncio
import json
import os
import pty
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Callable
from typing import Any

import can
import cantools
import numpy as np

from benchmarks.timing import summary_ms
from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import DriverError, ReadTimeout
from ghest_drivers.hardware.encoders.binary_frame import DOCUMENTED_RAD_PER_COUNT, BinaryFrameDecoder, documented_format
from ghest_drivers.hardware.encoders.builder import SampleBuilder
from ghest_drivers.hardware.encoders.can_bus import CanBusSettings
from ghest_drivers.hardware.encoders.can_layout import CanDecoder, CanLayout
from ghest_drivers.hardware.encoders.can_link import CanEncoderLink, CanSettings
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.checksums import crc8_j1850
from ghest_drivers.hardware.encoders.link import SampleQueueLink
from ghest_drivers.hardware.encoders.serial_link import SerialEncoderLink, SerialSettings
from ghest_drivers.hardware.encoders.stats import LinkStats
from ghest_rt.config.shipped import shipped_config_dir

_RATE_HZ = 1000
_JOINTS = 7
_LAYOUT = documented_format(_JOINTS)
_CHANNELS = tuple(
    Channel(f"j{k}", f"a{k}", DOCUMENTED_RAD_PER_COUNT, min_rad=-3.0, max_rad=3.0, max_rate_rad_s=20.0) for k in range(_JOINTS)
)
_SERIAL = SerialSettings("", _LAYOUT, _CHANNELS, time_tick_ns=1000)
_DBC = (shipped_config_dir() / "armeo_spring.dbc").read_text(encoding="utf-8")
_CAN_LAYOUT = CanLayout(
    _DBC, "Armeo_Wrist.DeviceTime", 10_000, "Armeo_Wrist.Status", counter_signal="Counter", checksum_signal="Checksum"
)
_MESSAGES = sorted(cantools.database.load_string(_DBC, "dbc").messages, key=lambda message: message.frame_id)
_ANGLES = [(message.name, signal.name) for message in _MESSAGES for signal in message.signals if signal.unit == "deg"]
_CAN_CHANNELS = tuple(
    Channel(f"j{k}", f"{message}.{signal}", 0.0174532925, min_rad=-3.0, max_rad=3.0, max_rate_rad_s=20.0)
    for k, (message, signal) in enumerate(_ANGLES)
)


def run(quick: bool) -> dict[str, Any]:
    """Measure both paths."""
    return measure(5.0 if quick else 60.0)


def measure(seconds: float) -> dict[str, Any]:
    """Measure both paths for so long."""
    return {
        "serial_decode": _decode_serial(),
        "can_decode": _decode_can(),
        "serial_pty": asyncio.run(_serial(seconds)),
        "can_virtual": asyncio.run(_can(seconds)),
    }


def _there_and_back(seq: int) -> int:
    return abs(seq % 2000 - 1000)


def _frame(seq: int, t_ns: int) -> bytes:
    return _LAYOUT.encode({"seq": seq, "time": t_ns // 1000, **{f"a{k}": 10 * _there_and_back(seq) for k in range(_JOINTS)}})


def _can_frames(seq: int, t_ns: int) -> list[can.Message]:
    values = {signal: 0.01 * _there_and_back(seq) for _, signal in _ANGLES}
    values |= {"Counter": seq % 256, "Checksum": 0, "Status": 0, "DeviceTime": t_ns // 10_000 % (1 << 24) * 10}
    frames = []
    for message in _MESSAGES:
        data = message.encode({signal.name: values[signal.name] for signal in message.signals})[:-1]
        data += bytes([crc8_j1850(message.frame_id.to_bytes(2, "little") + data)])
        frames.append(can.Message(arbitration_id=message.frame_id, data=data, is_extended_id=False))
    return frames


def _decode_serial() -> dict[str, float]:
    stats = LinkStats()
    decoder = BinaryFrameDecoder(_LAYOUT, [channel.source for channel in _CHANNELS], stats)
    builder = SampleBuilder(_CHANNELS, _SERIAL.counting, stats)

    def one(seq: int, frame: bytes) -> None:
        for reading in decoder.feed(frame):
            builder.build(reading, seq * 1_000_000 + 200_000)

    return _timed(one, [_frame(seq, seq * 1_000_000) for seq in range(20_000)], stats)


def _decode_can() -> dict[str, float]:
    stats = LinkStats()
    decoder = CanDecoder(_CAN_LAYOUT, _CAN_CHANNELS, stats)
    builder = SampleBuilder(_CAN_CHANNELS, decoder.counting(0, 0xFF), stats)

    def one(seq: int, frames: list[tuple[int, bytes]]) -> None:
        t_ns = seq * 1_000_000 + 200_000
        for frame_id, data in frames:
            whole = decoder.feed(frame_id, data, t_ns, t_ns)
            if whole is not None:
                builder.build(whole[0], t_ns, whole[1])

    samples = [[(f.arbitration_id, bytes(f.data)) for f in _can_frames(seq, seq * 1_000_000)] for seq in range(5_000)]
    return _timed(one, samples, stats)


def _timed(one: Callable[[int, Any], None], items: list[Any], stats: LinkStats) -> dict[str, float]:
    spent = []
    for seq, item in enumerate(items):
        start = time.perf_counter()
        one(seq, item)
        spent.append(time.perf_counter() - start)
    p50, p99 = np.percentile(np.array(spent) * 1e6, (50, 99))
    return {"median_us": round(float(p50), 2), "p99_us": round(float(p99), 2), "accepted": stats.accepted, "of": len(items)}


async def _serial(seconds: float) -> dict[str, Any]:
    master, slave = pty.openpty()
    tty.setraw(slave)
    link = SerialEncoderLink(SerialSettings(os.ttyname(slave), _LAYOUT, _CHANNELS), MonotonicClock())
    await link.open()
    command = [sys.executable, "-m", "benchmarks.encoder_path", "--send", str(master), "--seconds", str(seconds)]
    sender = await asyncio.to_thread(subprocess.Popen, command, pass_fds=(master,))
    try:
        return await _receive(link, seconds, time_wrap_ns=1000 << 32)
    finally:
        await asyncio.to_thread(sender.wait)
        await link.close()
        os.close(slave)
        os.close(master)


async def _can(seconds: float) -> dict[str, Any]:
    bus = can.Bus(interface="virtual", channel="benchmark")
    link = CanEncoderLink(CanSettings(CanBusSettings("virtual", "benchmark"), _CAN_LAYOUT, _CAN_CHANNELS), MonotonicClock())
    await link.open()

    def send(seq: int, t_ns: int) -> None:
        for frame in _can_frames(seq, t_ns):
            bus.send(frame)

    sender = threading.Thread(target=_send, args=(send, seconds))
    sender.start()
    try:
        return await _receive(link, seconds, time_wrap_ns=10_000 << 24)
    finally:
        await asyncio.to_thread(sender.join)
        await link.close()
        bus.shutdown()


async def _receive(link: SampleQueueLink, seconds: float, time_wrap_ns: int) -> dict[str, Any]:
    """Count what arrives; the device time of a sample is the host's clock at the moment it was sent."""
    latency_s, error_s, received = [], [], 0
    timeout_s = 20.0  # the sender has to start
    while True:
        try:
            sample = await link.read(timeout_s)
        except ReadTimeout:
            break
        except DriverError:
            if received:
                break
            await link.close()  # silent while the sender starts
            await link.open()
            continue
        timeout_s = 0.5
        received += 1
        late_ns = (sample.t_arrival_ns - sample.t_device_ns) % time_wrap_ns
        latency_s.append(late_ns * 1e-9)
        error_s.append(abs(sample.t_capture_ns - sample.t_arrival_ns + late_ns) * 1e-9)
    sent = round(seconds * _RATE_HZ)
    return {
        "sent": sent,
        "received": received,
        "lost": link.stats.lost,
        "rejected": dict(link.stats.rejected),
        **{f"latency_{key}": value for key, value in summary_ms(latency_s).items()},
        **{f"capture_error_{key}": value for key, value in summary_ms(error_s[len(error_s) // 10 :]).items()},
    }


def _send(send: Callable[[int, int], None], seconds: float) -> None:
    start_ns = time.monotonic_ns()
    for seq in range(round(seconds * _RATE_HZ)):
        due_ns = start_ns + seq * 1_000_000_000 // _RATE_HZ
        time.sleep(max(due_ns - time.monotonic_ns(), 0) * 1e-9)
        send(seq, time.monotonic_ns())


def main() -> None:
    """Run the benchmark, or be its sender."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--send", type=int, help="be the sender, on this descriptor")
    arguments = parser.parse_args()
    if arguments.send is not None:
        _send(lambda seq, t_ns: _write_all(arguments.send, _frame(seq, t_ns)), arguments.seconds)
        return
    print(json.dumps(measure(arguments.seconds), indent=2))


def _write_all(fd: int, data: bytes) -> None:
    while data:
        data = data[os.write(fd, data) :]


if __name__ == "__main__":
    main()
