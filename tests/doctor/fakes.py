"""Devices that are watched live, on a virtual clock."""

from typing import Any

import numpy as np

from ghest_drivers.clock import VirtualClock
from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, Intrinsics, RgbdFrame

CAMERA = CameraInfo("r0", "m", "s", Intrinsics(8, 8, 9, 9, 4, 4), Intrinsics(8, 8, 9, 9, 4, 4), 0.001, np.eye(4), 50.0)


class FakeCamera:
    """Delivers frames on a virtual clock."""

    def __init__(self, clock: VirtualClock, *, period_ns: int = 20_000_000, depth: int = 500, step: int = 1, error: Any = None):
        self.clock, self.period_ns, self.depth, self.step, self.error = clock, period_ns, depth, step, error
        self.info = CAMERA
        self.k = 0

    def open(self) -> None:
        if isinstance(self.error, DeviceNotFound):
            raise self.error

    def read(self, timeout_s: float) -> RgbdFrame:
        self.clock.sleep_until_ns(self.clock.now_ns() + self.period_ns)
        self.k += 1
        if self.error is not None and self.k % 3 == 0:
            raise self.error
        t_ns = self.clock.now_ns()
        depth = np.full((8, 8), self.depth, np.uint16)
        return RgbdFrame(CAMERA, self.k * self.step, np.zeros((8, 8, 3), np.uint8), depth, 0, t_ns, t_ns - 5_000_000, t_ns)

    def close(self) -> None:
        """Nothing to close."""


class FakeEncoders:
    """Delivers samples on a virtual clock."""

    info = EncoderInfo("encoders", ("j0",))

    def __init__(self, clock: VirtualClock, period_ns: int) -> None:
        self.clock, self.period_ns, self.k = clock, period_ns, 0

    async def open(self) -> None:
        """Nothing to open."""

    async def read(self, timeout_s: float) -> EncoderSample:
        self.clock.sleep_until_ns(self.clock.now_ns() + self.period_ns)
        self.k += 1
        t_ns = self.clock.now_ns()
        return EncoderSample(self.k, np.array([np.pi / 2]), t_ns, t_ns, t_ns)

    async def close(self) -> None:
        """Nothing to close."""
