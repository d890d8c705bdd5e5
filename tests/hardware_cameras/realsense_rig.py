"""A software RealSense device with the driver on it, on a virtual host clock."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ghest_drivers.clock import MonotonicClock, VirtualClock
from ghest_drivers.errors import ReadTimeout
from ghest_drivers.hardware.realsense.camera import RealsenseCamera
from ghest_drivers.hardware.realsense.settings import RealsenseSettings
from ghest_drivers.hardware.realsense.software import SoftwareRealsense, write_bag
from ghest_drivers.hardware.realsense.source import ConnectedDevice
from ghest_drivers.hardware.realsense.timestamps import TimeDomain
from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame

PERIOD_NS = 16_666_667
LONG_S = 20.0
COLOR_FROM_DEPTH = np.array([[0, -1, 0, 0.025], [1, 0, 0, 0.001], [0, 0, 1, -0.002], [0, 0, 0, 1.0]])
INFO = CameraInfo(
    "r0",
    "Intel RealSense SR300",
    "S1",
    Intrinsics(64, 48, 62, 61, 32, 24, (0.1, -0.05, 0.001, 0.0005, 0.01)),
    Intrinsics(32, 24, 24, 25, 15.5, 12.25),
    0.000125,
    COLOR_FROM_DEPTH,
    60.0,
)
SETTINGS = RealsenseSettings(
    width_px=64, height_px=48, depth_width_px=32, depth_height_px=24, exposure_us=None, latency_ns=0, queue_frames=64
)


def color_of(k: int) -> Any:
    return np.full((48, 64, 3), (k % 256, 7, 9), np.uint8)


def depth_of(k: int) -> Any:
    return np.full((24, 32), 1000 + k, np.uint16)


class Rig:
    """A software device, the driver on it, and a virtual host clock."""

    def __init__(self, settings: RealsenseSettings = SETTINGS, **options: Any) -> None:
        self.device = SoftwareRealsense(INFO, **options)
        self.clock = VirtualClock(5_000_000_000)
        self.context = self.device.context()
        self.unix_ns = 1_700_000_000_000_000_000 - 5_000_000_000
        source = ConnectedDevice("S1", settings.latency_ns, lambda: self.unix_ns + self.clock.now_ns())
        self.camera = RealsenseCamera("r0", source, settings, self.clock, context=lambda: self.context)

    def send(self, k: int, t_device_ns: int, *, domain: TimeDomain = TimeDomain.HARDWARE, streams: str = "dc") -> None:
        if "d" in streams:
            self.device.send_depth(depth_of(k), k, t_device_ns, domain)
        if "c" in streams:
            self.device.send_color(color_of(k), 100 + k, t_device_ns, domain)

    def send_in_time(self, k: int, *, streams: str = "dc") -> None:
        """Send image `k` one period after the one before, by both clocks."""
        self.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        self.send(k, 1_000_000_000 + k * PERIOD_NS, streams=streams)

    def read_all(self) -> list[RgbdFrame]:
        frames = []
        while True:
            try:
                frames.append(self.camera.read(0.0))
            except ReadTimeout:
                return frames


@contextmanager
def opened(settings: RealsenseSettings = SETTINGS, **options: Any) -> Iterator[Rig]:
    """A rig whose camera is open."""
    rig = Rig(settings, **options)
    rig.camera.open()
    try:
        yield rig
    finally:
        rig.camera.close()


def record_bag(path: Path, start_ns: int, frames: int) -> Path:
    """Have the SDK's recorder write a .bag file of so many frames, a period apart."""
    times_ns = [start_ns + k * PERIOD_NS for k in range(frames)]
    recorded = (RgbdFrame(INFO, k, color_of(k), depth_of(k), t, t, t, t) for k, t in enumerate(times_ns))
    assert write_bag(path, INFO, recorded, MonotonicClock()) == frames
    return path
