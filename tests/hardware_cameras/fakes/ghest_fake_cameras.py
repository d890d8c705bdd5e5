"""Camera backends that misbehave, for the supervisor's child process to import."""

import ctypes
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np

from ghest_drivers.clock import Clock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DeviceNotFound, EndOfStream, ReadTimeout
from ghest_drivers.samples import CameraInfo, DeviceVitals, Intrinsics, RgbdFrame

INFO = CameraInfo("r0", "fake", "F1", Intrinsics(8, 6, 7, 7, 3.5, 2.5), Intrinsics(4, 3, 5, 5, 1.5, 1), 0.001, np.eye(4), 100.0)


class FakeCamera:
    """Sends `frames` frames, `period_s` apart, then does what `then` says."""

    def __init__(
        self, name: str, clock: Clock, *, then: str, frames: int = 5, period_s: float = 0.005, log: str = "", on_open: str = ""
    ) -> None:
        self._clock = clock
        self._then = then
        self._frames = frames
        self._period_s = period_s
        self._log = Path(log) if log else None
        self._on_open = on_open
        self._sent = 0
        self.info = INFO

    def _note(self, what: str) -> None:
        if self._log is not None:
            with self._log.open("a") as file:
                file.write(what + "\n")

    def reset(self) -> None:
        self._note("reset")

    def open(self) -> None:
        self._note("open")
        _misbehave(self._on_open)

    def close(self) -> None:
        self._note("close")
        if self._then == "hang in close":
            time.sleep(3600)

    def read(self, timeout_s: float) -> RgbdFrame:
        if self._sent >= self._frames:
            _misbehave(self._then)
            time.sleep(timeout_s)
            raise ReadTimeout("nothing")
        time.sleep(self._period_s)
        k = self._sent
        self._sent += 1
        if self._then == "bad data" and k == 2:
            raise BadDeviceData("frame 2 is garbled")
        t_ns = self._clock.now_ns()
        depth = None if k % 2 else np.full((3, 4), 1000 + k, np.uint16)
        return RgbdFrame(INFO, k, np.full((6, 8, 3), k % 256, np.uint8), depth, 11 * k, t_ns, t_ns - 1000, t_ns - 2000)


def _misbehave(how: str) -> None:
    if how == "hang":
        time.sleep(3600)
    elif how == "hang with the interpreter held":
        ctypes.PyDLL(None).sleep(3600)
    elif how == "segfault":
        os.kill(os.getpid(), signal.SIGSEGV)
    elif how == "exit":
        os._exit(7)
    elif how == "lost":
        raise DeviceLost("the cable was pulled")
    elif how == "not found":
        raise DeviceNotFound("no camera with serial F1")
    elif how == "end":
        raise EndOfStream("that was all")
    elif how == "foreign error":
        raise RuntimeError("xioctl failed")
    elif how == "stop thread":
        threading.Event().wait()


class VitalCamera(FakeCamera):
    """Says how it is doing."""

    def vitals(self) -> DeviceVitals:
        return DeviceVitals({"bad": 3}, 41.0)
