"""The service's end of one camera process: start, read, watch, end."""

import contextlib
import logging
import multiprocessing
import os
import signal
import threading
from dataclasses import dataclass
from multiprocessing import connection
from multiprocessing.context import SpawnProcess

from ghest_drivers.clock import Clock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DriverError, ReadTimeout
from ghest_drivers.hardware.supervisor import child
from ghest_drivers.hardware.supervisor.protocol import Attach, BackendSpec, Opened, Problem, Stop
from ghest_drivers.hardware.supervisor.ring import FrameRing, RingLayout
from ghest_drivers.samples import CameraInfo, DeviceVitals, RgbdFrame

_log = logging.getLogger(__name__)
_POLL_S = 0.05
_KILLED_S = 2.0
_DYING_S = 1.0
_SPAWN = multiprocessing.get_context("spawn")  # a fork would take over locks and threads of the service


@dataclass(frozen=True, slots=True)
class Limits:
    """How long to wait for the camera's process.

    Attributes:
        open_s: From its start until the camera is open; a hardware reset takes some seconds of it.
        first_frame_s: From there to the first frame.
        silence_s: From one frame to the next.
        close_s: From being told to stop until it is killed.
        slots: Frames held in shared memory.
    """

    open_s: float = 25.0
    first_frame_s: float = 5.0
    silence_s: float = 0.5
    close_s: float = 0.5
    slots: int = 8


class ChildLink:
    """A running camera process.

    Raises:
        DeviceLost: It crashed or did not open the camera in time, or `abort` was set.
        DriverError: What the backend's own `open` raised.
    """

    def __init__(
        self, name: str, spec: BackendSpec, clock: Clock, limits: Limits, *, abort: threading.Event, reset: bool
    ) -> None:
        self._name = name
        self._clock = clock
        self._limits = limits
        self._failure: DriverError | None = None
        self._closed = False
        self.overwritten = 0
        self.vitals = DeviceVitals()
        self._reading = threading.Lock()
        self._ring: FrameRing | None = None
        self._control, child_control = _SPAWN.Pipe()
        self._wake, self._wake_writer = _SPAWN.Pipe(duplex=False)
        self._process: SpawnProcess = _SPAWN.Process(
            target=child.run, args=(name, spec, child_control, self._wake_writer, reset), name=f"camera-{name}", daemon=True
        )
        self._process.start()
        child_control.close()
        try:
            self.info = self._await_opened(abort)
            layout = RingLayout.of(self.info, limits.slots)
            self._ring = FrameRing(layout)
            self._tell(Attach(self._ring.name, layout))
        except DriverError:
            self._kill()
            self._release()
            raise
        self._last_ns = clock.now_ns()
        self._patience_ns = round(limits.first_frame_s * 1e9)

    @property
    def pid(self) -> int:
        """The child's process id."""
        return self._process.pid or 0

    def read(self, timeout_s: float) -> RgbdFrame:
        """Return the next frame; see `RgbdCamera.read`. Watches the child while it waits."""
        with self._reading:
            deadline_ns = self._clock.now_ns() + round(max(timeout_s, 0.0) * 1e9)
            while True:
                frame = self._next_frame()
                if frame is not None:
                    return frame
                now_ns = self._clock.now_ns()
                self._check_silence(now_ns)
                if now_ns >= deadline_ns:
                    raise ReadTimeout(f"camera {self._name}: no frame within {timeout_s:.3f} s")
                self._wait(min(deadline_ns, self._last_ns + self._patience_ns) - now_ns)

    def close(self) -> None:
        """End the process, kindly at first; a blocked `read` raises DeviceLost."""
        self._closed = True
        with contextlib.suppress(BlockingIOError):  # full: the reader wakes anyway
            os.write(self._wake_writer.fileno(), b"\0")
        self._tell(Stop())
        with self._reading:
            self._process.join(self._limits.close_s)
            self._kill()
            self._release()

    def _await_opened(self, abort: threading.Event) -> CameraInfo:
        deadline_ns = self._clock.now_ns() + round(self._limits.open_s * 1e9)
        while not self._control.poll(_POLL_S):
            if abort.is_set():
                raise DeviceLost(f"camera {self._name} was closed while it was being opened")
            if self._clock.now_ns() > deadline_ns:
                raise DeviceLost(f"camera {self._name} did not open within {self._limits.open_s:g} s: its process was ended")
        message = self._receive()
        if isinstance(message, Opened):
            return message.info
        raise message if isinstance(message, DriverError) else DeviceLost(f"camera {self._name}: unexpected {message!r}")

    def _next_frame(self) -> RgbdFrame | None:
        """Return what is in the ring; only when that is empty, raise what ended the stream."""
        if self._closed or self._ring is None:
            raise DeviceLost(f"camera {self._name} is closed")
        frame = self._ring.get(self.info)
        if frame is not None:
            self._last_ns = self._clock.now_ns()
            self._patience_ns = round(self._limits.silence_s * 1e9)
            return frame
        if self._failure is not None:
            raise self._failure
        return None

    def _check_silence(self, now_ns: int) -> None:
        if now_ns - self._last_ns < self._patience_ns:
            return
        self._kill()
        self._failure = DeviceLost(
            f"camera {self._name}: no frame for {(now_ns - self._last_ns) * 1e-6:.0f} ms: its process was ended"
        )
        raise self._failure

    def _wait(self, wait_ns: int) -> None:
        """Sleep until a frame, a message, the child's end, or `wait_ns` have come."""
        ready = connection.wait([self._wake, self._control, self._process.sentinel], max(wait_ns, 0) * 1e-9)
        if self._wake in ready:
            os.read(self._wake.fileno(), 4096)
        if self._control in ready:
            message = self._receive()
            if isinstance(message, BadDeviceData):
                raise message
            if isinstance(message, DeviceVitals):
                self.vitals = message
            elif isinstance(message, DriverError):
                self._failure = message
        elif self._process.sentinel in ready:
            self._failure = DeviceLost(f"camera {self._name}: its process {self._how_it_ended()}")

    def _receive(self) -> Opened | DeviceVitals | DriverError:
        try:
            message = self._control.recv()
        except (EOFError, OSError):
            return DeviceLost(f"camera {self._name}: its process {self._how_it_ended()}")
        if isinstance(message, Opened | DeviceVitals):
            return message
        return message.error() if isinstance(message, Problem) else DeviceLost(f"camera {self._name}: unexpected {message!r}")

    def _tell(self, message: Attach | Stop) -> None:
        try:
            self._control.send(message)
        except OSError:  # it has died: the next read says so
            _log.debug("camera %s: its process does not listen", self._name)

    def _how_it_ended(self) -> str:
        self._process.join(_DYING_S)  # its pipes close before it can be reaped
        code = self._process.exitcode
        if code is None:
            return "stopped answering"
        if code < 0:
            return f"crashed ({signal.Signals(-code).name})"
        return f"ended (exit code {code})"

    def _kill(self) -> None:
        if self._process.is_alive():
            self._process.kill()
        self._process.join(_KILLED_S)

    def _release(self) -> None:
        for pipe in (self._control, self._wake, self._wake_writer):
            pipe.close()
        if self._ring is not None:
            self.overwritten = self._ring.overwritten
            self._ring.close()
            self._ring = None
        if self._process.is_alive():
            _log.error("camera %s: process %d cannot be ended (stuck in the kernel); it is left behind", self._name, self.pid)
        else:
            self._process.close()
