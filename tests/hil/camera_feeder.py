"""What stands in for a camera's hardware: a thread that delivers the scene's frames at their time, with the faults injected."""

import os
import random
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

from ghest_drivers.errors import DeviceNotFound
from tests.hil.injection import DeviceClock, Injected
from tests.hil.scene import FRAME_RATE_HZ, Scene, read_scene

LATENCY_NS = 16_666_667  # mid-exposure to delivery: what the RealSense driver takes for granted
_BURST_FRAMES = 15

Send = Callable[[str, int, int, int], None]


class CameraFeeder:
    """Calls `send(view, index, number, t_capture_ns)` for every frame, on its own thread, for as long as the process lives.

    `view` is the camera whose image is to be sent, `index` which of the scene's images.
    """

    def __init__(self, folder: Path, name: str) -> None:
        self.scene: Scene = read_scene(folder)
        self._name = name
        self._injected = Injected(folder, name)
        self.clock = DeviceClock(self._injected)
        self._random = random.Random(name)
        if self._injected.fault(time.monotonic_ns()) == "unplugged":
            raise DeviceNotFound(f"camera {name}: no such device")

    def start(self, send: Send) -> None:
        """Begin with the frame that is due next."""
        threading.Thread(target=self._run, args=(send,), daemon=True).start()

    def _run(self, send: Send) -> None:
        scene, name = self.scene, self._name
        other = "r1" if name == "r0" else "r0"
        j = int((time.monotonic_ns() - scene.epoch_ns) * FRAME_RATE_HZ // 1_000_000_000) + 1
        held: list[tuple[str, int, int, int]] = []
        frozen: int | None = None
        while True:
            t_ns = scene.frame_time_ns(j)
            time.sleep(max((t_ns + LATENCY_NS - time.monotonic_ns()) * 1e-9, 0.0))
            fault = self._injected.fault(t_ns)
            index = scene.frame_index(j)
            frozen = (index if frozen is None else frozen) if fault == "frozen" else None
            if fault == "unplugged":
                os.kill(os.getpid(), signal.SIGKILL)
            frame = (other if fault == "swapped" else name, index if frozen is None else frozen, j, t_ns)
            if fault == "bursts":
                held.append(frame)
                if len(held) < _BURST_FRAMES:
                    frame = None  # type: ignore[assignment]
            lost = fault == "silent" or (fault == "drops" and self._random.random() < 0.5)
            if frame is not None and not lost:
                for one in held or [frame]:
                    send(*one)
                held = []
            j += 1
