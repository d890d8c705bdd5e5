"""A simulated Armeo at the far end of a serial line or a CAN bus: `python -m tests.hil.armeo_talker pty|can CHANNEL [PORT]`.

`pty` makes a pseudo-terminal and a link to it at CHANNEL. Samples every 15.6 ms, latched by a clock of its own.
"""

import contextlib
import math
import os
import pty
import random
import sys
import time
import tty
from collections.abc import Callable
from pathlib import Path

from ghest_drivers.hardware.encoders.binary_frame import documented_format
from tests.hil.injection import DeviceClock, Injected, hil_folder
from tests.hil.scene import Scene, read_scene

PERIOD_NS = 15_600_000
LATENCY_NS = 1_000_000
_CLOCK_START_NS = (1 << 32) * 1000 - 20_000_000_000  # the counter of microseconds wraps after 20 s

Write = Callable[[bytes], None]
SendSample = Callable[[int, int, list[float], str], None]


def main() -> None:
    kind, channel = sys.argv[1:3]
    scene = read_scene(hil_folder())
    send = serial_sender(len(scene.joint_names), Path(channel)) if kind == "pty" else can_sender(channel, int(sys.argv[3]))
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    talk(scene, Injected(hil_folder(), "encoders"), send)


def talk(scene: Scene, injected: Injected, send: SendSample) -> None:
    """Send samples for ever."""
    seq = (time.monotonic_ns() - scene.epoch_ns) // PERIOD_NS
    jumped = 0
    clock = DeviceClock(injected)
    while True:
        seq += 1
        t_ns = scene.epoch_ns + seq * PERIOD_NS
        time.sleep(max((t_ns + LATENCY_NS - time.monotonic_ns()) * 1e-9, 0.0))
        fault = injected.fault(t_ns)
        if fault in {"silent", "unplugged"}:
            continue
        jumped += 1000 if fault == "counter_jumps" and seq % 5 == 0 else 0
        t_device_ns = round((t_ns - scene.epoch_ns) * 0.99998) + _CLOCK_START_NS
        send(seq + jumped, t_device_ns + clock.off_ns(t_ns), [math.degrees(angle) for angle in scene.joints_at(t_ns)], fault)


def serial_sender(joints: int, link: Path) -> SendSample:
    """Make the pseudo-terminal; the documented binary frame goes out there."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    os.set_blocking(master, False)
    with contextlib.suppress(FileNotFoundError):
        link.unlink()
    link.symlink_to(os.ttyname(slave))
    layout = documented_format(joints)
    noise = random.Random(1)

    def send(seq: int, t_device_ns: int, angles_deg: list[float], fault: str) -> None:
        values = {f"a{k}": angle * 1e4 for k, angle in enumerate(angles_deg)}
        frame = bytearray(layout.encode({"seq": seq, "time": t_device_ns // 1000, **values}))
        if fault == "garbage":
            frame = bytearray(noise.randbytes(len(frame) * 3))
        elif fault == "crc_errors":
            frame[noise.randrange(4, len(frame))] ^= 1 << noise.randrange(8)
        with contextlib.suppress(BlockingIOError):  # nobody reads
            os.write(master, frame)

    return send


def can_sender(channel: str, port: int) -> SendSample:
    """Open the bus; the three frames of config/armeo_spring.dbc go out there."""
    import can

    from tests.hardware_encoders.can_senders import armeo_frames

    bus = can.Bus(interface="udp_multicast", channel=channel, port=port)
    noise = random.Random(2)

    def send(seq: int, t_device_ns: int, angles_deg: list[float], fault: str) -> None:
        frames = armeo_frames(seq, t_device_ns, angles_deg)
        for k, frame in enumerate(frames):
            if fault == "garbage":
                frames[k] = can.Message(arbitration_id=frame.arbitration_id, data=noise.randbytes(8), is_extended_id=False)
            elif fault == "crc_errors":
                frame.data[noise.randrange(8)] ^= 1 << noise.randrange(8)
            elif fault == "bus_off":
                frames[k] = can.Message(is_error_frame=True, arbitration_id=0x40, data=bytes(8), is_extended_id=False)
            bus.send(frames[k])

    return send


if __name__ == "__main__":
    main()
