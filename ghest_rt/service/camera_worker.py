"""One thread per camera: read a frame, find the marker in it there, hand only the result to the event loop."""

import asyncio
import contextlib
import logging
import threading
from collections.abc import Callable
from typing import TypeVarTuple, Unpack

import numpy as np

from ghest_drivers.clock import Clock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DriverError, EndOfStream, ReadTimeout
from ghest_drivers.interfaces import RgbdCamera, TellsVitals
from ghest_drivers.samples import CameraInfo, DeviceVitals, RgbdFrame
from ghest_rt.messages.published import EventKind, InputState
from ghest_rt.messages.results import MarkerObservation
from ghest_rt.service.inputs import InputCounters, InputListener, InputSettings, Severity

_log = logging.getLogger(__name__)

_Args = TypeVarTuple("_Args")
Observe = Callable[[RgbdFrame], MarkerObservation]


class CameraWorker:
    """Keeps a camera open and its frames flowing through vision, whatever the device does."""

    def __init__(
        self,
        *,
        name: str,
        camera: RgbdCamera,
        observe: Observe,
        listener: InputListener,
        clock: Clock,
        settings: InputSettings,
    ) -> None:
        self.counters = InputCounters()
        self.finished = asyncio.Event()
        self._name = name
        self._camera = camera
        self._observe = observe
        self._listener = listener
        self._clock = clock
        self._settings = settings
        self._stop = threading.Event()
        self._go = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._first_ns = -1
        self._skips_told = False

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Open the camera on a thread of its own."""
        self._loop = loop
        threading.Thread(target=self._run, name=f"camera-{self._name}", daemon=True).start()

    def go(self) -> None:
        """Let frames through; until then the camera is only opened."""
        self._go.set()

    def vitals(self) -> DeviceVitals:
        """Return what the camera says of itself."""
        return self._camera.vitals() if isinstance(self._camera, TellsVitals) else DeviceVitals()

    def stop(self) -> None:
        """Ask the thread to end, without waiting; `finished` is set when it has."""
        self._stop.set()
        self._go.set()
        # A vendor's close may block for long: not on the event loop.
        threading.Thread(target=self._close, name=f"close-{self._name}", daemon=True).start()

    def _run(self) -> None:
        error: Exception | None = None
        try:
            error = self._keep_open()
        finally:
            self._close()
            if not self._stop.is_set():
                self._post(self._listener.input_ended, self._name, error)
            self._post(self.finished.set)

    def _keep_open(self) -> Exception | None:
        delays_s = self._settings.backoff.delays_s()
        while not self._stop.is_set():
            received = self.counters.received
            try:
                self._camera.open()
                self._post(self._listener.camera_connected, self._name, self._camera.info)
                self._go.wait()
                self._stream()
            except EndOfStream:
                self.counters.state = InputState.ENDED
                self._event(EventKind.INPUT_ENDED, "info", "no more frames")
                return None
            except Exception as error:  # vendor libraries raise what they like; none of it may end the service
                if self._stop.is_set():
                    break
                if not isinstance(error, DriverError):
                    _log.exception("camera %s: unexpected error", self._name)
                self.counters.state = InputState.LOST
                self._event(EventKind.INPUT_LOST, "error", f"{type(error).__name__}: {error}")
                if not self._settings.reconnect:
                    return error
                self._close()
                if self.counters.received > received:
                    delays_s = self._settings.backoff.delays_s()
                if self._stop.wait(next(delays_s)):
                    break
                self.counters.reopened += 1
                self.counters.last_seq = None
        return None

    def _stream(self) -> None:
        counters, settings = self.counters, self._settings
        in_vain = 0
        while not self._stop.is_set():
            try:
                frame = self._newest_useful(self._camera.read(settings.read_timeout_s))
            except ReadTimeout:
                in_vain += 1
                if in_vain == settings.silent_after:
                    counters.state = InputState.SILENT
                    self._event(EventKind.INPUT_SILENT, "warning", "the camera is open but sends no frames")
                if in_vain >= settings.lost_after:
                    raise DeviceLost(f"no frame for {in_vain * settings.read_timeout_s:.1f} s") from None
                continue
            except BadDeviceData as error:
                self._bad(error)
                continue
            in_vain = 0
            if counters.state is not InputState.STREAMING:
                counters.state = InputState.STREAMING
                self._event(EventKind.INPUT_STREAMING, "info", "frames are arriving")
            try:
                observation = self._observe(frame)
            except Exception as error:  # one frame that vision cannot digest must not silence the camera
                _log.exception("camera %s: frame %d", self._name, frame.seq)
                self._bad(error)
                continue
            self._post(self._listener.observed, observation)

    def _newest_useful(self, frame: RgbdFrame) -> RgbdFrame:
        """Pass over frames that have waited too long while a newer one is there: vision is slow, or the camera late.

        Only what waited when it began is passed over: whatever comes meanwhile is the newest there can be, even if it is old,
        since a camera on a machine that is too busy delivers nothing else.
        """
        self.counters.count(frame.seq, frame.t_capture_ns)
        t_begin_ns = self._clock.now_ns()
        if self._first_ns < 0:
            self._first_ns = t_begin_ns
        while frame.t_arrival_ns <= t_begin_ns and self._clock.now_ns() - frame.t_arrival_ns > self._settings.max_backlog_ns:
            try:
                newer = self._camera.read(0.0)
            except (ReadTimeout, EndOfStream):
                break
            self.counters.count(newer.seq, newer.t_capture_ns)
            self.counters.skipped += 1
            if not self._skips_told and t_begin_ns - self._first_ns >= self._settings.settled_after_ns:
                self._skips_told = True
                self._event(
                    EventKind.FRAMES_SKIPPED,
                    "warning",
                    "frames wait too long for vision, or come too late: old ones are passed over",
                )
            frame = newer
        return frame

    def _bad(self, error: Exception) -> None:
        if not self.counters.bad:
            self._event(EventKind.BAD_DATA, "warning", f"a frame was not usable: {error} (more are only counted)")
        self.counters.bad += 1

    def _event(self, kind: EventKind, severity: Severity, message: str) -> None:
        self._post(self._listener.input_event, self._name, kind, severity, message)

    def _post(self, callback: Callable[[Unpack[_Args]], object], *args: *_Args) -> None:
        if self._loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop has closed: nobody is left to tell
                self._loop.call_soon_threadsafe(callback, *args)

    def _close(self) -> None:
        try:
            self._camera.close()
        except Exception:
            _log.exception("camera %s: close failed", self._name)


def same_camera(a: CameraInfo, b: CameraInfo) -> bool:
    """Return whether two descriptions of a camera give the same geometry."""
    return (
        a.color == b.color
        and a.depth == b.depth
        and a.depth_unit_m == b.depth_unit_m
        and bool(np.array_equal(a.color_from_depth, b.color_from_depth))
    )
