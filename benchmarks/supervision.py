"""What it costs to have a camera's driver in a process of its own: two streams of 640x480 RGB-D at 60 Hz."""

import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any

import numpy as np

from benchmarks.timing import summary_ms
from ghest_drivers.clock import Clock, MonotonicClock
from ghest_drivers.hardware.supervisor.camera import SupervisedCamera
from ghest_drivers.hardware.supervisor.protocol import BackendSpec
from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame

_RATE_HZ = 60.0
_SHAPE = (480, 640)
_LENS = Intrinsics(_SHAPE[1], _SHAPE[0], 475.0, 475.0, 319.5, 239.5)


class SteadyCamera:
    """Delivers the same images at the rate, without a device; runs in the supervisor's child."""

    def __init__(self, name: str, clock: Clock) -> None:
        self.info = CameraInfo(name, "steady", "0", _LENS, _LENS, 0.001, np.eye(4), _RATE_HZ)
        self._clock = clock
        self._seq = 0
        self._begun_ns = 0
        self._color = np.random.default_rng(0).integers(0, 255, (*_SHAPE, 3), dtype=np.uint8)
        self._depth = np.full(_SHAPE, 250, np.uint16)

    def open(self) -> None:
        """Begin the stream."""
        self._begun_ns = self._clock.now_ns()

    def close(self) -> None:
        """Do nothing: there is no device."""

    def read(self, timeout_s: float) -> RgbdFrame:
        """Return the next image when its time has come."""
        self._seq += 1
        t_ns = self._begun_ns + round(self._seq * 1e9 / _RATE_HZ)
        time.sleep(max(t_ns - self._clock.now_ns(), 0) * 1e-9)
        return RgbdFrame(self.info, self._seq, self._color, self._depth, t_ns, self._clock.now_ns(), t_ns, t_ns)


def run(quick: bool) -> dict[str, Any]:
    """Read both for a while; the clock is the same in all processes."""
    seconds = 3.0 if quick else 30.0
    clock = MonotonicClock()
    cameras = [SupervisedCamera(name, BackendSpec(__name__, "SteadyCamera", {}), clock) for name in ("r0", "r1")]
    delays_s: list[float] = []

    def read(camera: SupervisedCamera) -> None:
        while time.monotonic() < end_s:
            frame = camera.read(1.0)
            delays_s.append((clock.now_ns() - frame.t_arrival_ns) * 1e-9)

    with ExitStack() as stack, ThreadPoolExecutor(len(cameras)) as pool:
        for camera in cameras:
            stack.callback(camera.close)
            camera.open()
        begun_s, cpu_s = time.monotonic(), time.process_time()
        end_s = begun_s + seconds
        list(pool.map(read, cameras))
        share = (time.process_time() - cpu_s) / (time.monotonic() - begun_s)
    return {
        "streams": f"{len(cameras)} of {_SHAPE[1]}x{_SHAPE[0]} at {_RATE_HZ:g} Hz",
        "frames": len(delays_s),
        "from arrival to delivery": summary_ms(delays_s),
        "of a core, in the reading process": f"{share:.1%}",
    }
