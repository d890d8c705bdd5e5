"""The OAK driver: device nodes, a Sync node on the host, and a thread that converts what comes out of it."""

import threading
from datetime import timedelta
from typing import Any

import numpy as np

from ghest_drivers.clock import Clock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DeviceNotFound, DriverError
from ghest_drivers.hardware.cameras.frame_queue import FrameQueue
from ghest_drivers.hardware.cameras.session_camera import SessionCamera
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.hardware.oak.frames import GroupConverter, nanoseconds
from ghest_drivers.hardware.oak.sdk import dai
from ghest_drivers.hardware.oak.settings import OakSettings
from ghest_drivers.hardware.oak.source import DEPTH_UNIT_M, ConnectedOak, Source
from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame

_POLL = timedelta(milliseconds=100)
_FIRST_FRAME_NS = 10_000_000_000
_READINGS = 8


class OakCamera(SessionCamera["_Session"]):
    """An `RgbdCamera` on DepthAI.

    Args:
        name: The camera's name in the station file.
        source: Where images come from.
        settings: Streams and options.
        clock: Host clock, of the same kind as CLOCK_MONOTONIC.
    """

    def __init__(self, name: str, source: Source, settings: OakSettings, clock: Clock) -> None:
        super().__init__(name)
        self._source = source
        self._settings = settings
        self._clock = clock

    def _start(self) -> "_Session":
        return _Session(self._name, self._source, self._settings, self._clock, self.stats)


class _Session:
    """From `open` to `close`. Opening ends with the first frame, which brings the calibration."""

    def __init__(self, name: str, source: Source, settings: OakSettings, clock: Clock, stats: CameraStats) -> None:
        self._name = name
        self._source = source
        self._clock = clock
        self._with_depth = settings.depth
        self._queue = FrameQueue(settings.queue_frames, stats)
        self._closing = threading.Event()
        self._pump: threading.Thread | None = None
        self._pipeline: dai.Pipeline | None = None
        try:
            images, sync = source.connect(settings)
            self._pipeline = images.pipeline
            sync.setRunOnHost(True)
            sync.setSyncThreshold(timedelta(microseconds=settings.period_ns / 2000))
            self._groups = sync.out.createOutputQueue(maxSize=settings.queue_frames, blocking=False)
            self._pipeline.start()
            size_px = Intrinsics(settings.width_px, settings.height_px, 1.0, 1.0, 0.0, 0.0)
            unknown = CameraInfo(
                name, images.model, images.serial, size_px, size_px, DEPTH_UNIT_M, np.eye(4), float(settings.rate_hz)
            )
            self._converter = GroupConverter(unknown, _sdk_offset_ns(clock), stats)
            self.info = self._first_frame()
        except RuntimeError as error:
            self.close()
            raise DeviceNotFound(f"camera {name} cannot be started: {error}") from error
        except DriverError:
            self.close()
            raise
        self._pump = threading.Thread(target=self._run, name=f"oak-{name}", daemon=True)
        self._pump.start()

    def read(self, timeout_s: float) -> RgbdFrame:
        """See `RgbdCamera.read`."""
        return self._queue.get(timeout_s)

    def temperature_c(self) -> float | None:
        """See `CameraSession.temperature_c`."""
        return self._source.temperature_c()

    def close(self) -> None:
        """Stop the nodes and let go of the device."""
        self._closing.set()
        self._queue.close()
        if self._pump is not None:
            self._pump.join()
        if self._pipeline is not None and self._pipeline.isRunning():
            self._pipeline.stop()
        self._pipeline = None
        self._source.release()

    def _first_frame(self) -> CameraInfo:
        deadline_ns = self._clock.now_ns() + _FIRST_FRAME_NS
        while self._clock.now_ns() < deadline_ns:
            frame = self._next_frame()
            if frame is not None:
                self._queue.put(frame)
                return frame.info
        raise DeviceLost(f"camera {self._name} was opened, but no pair of images came within {_FIRST_FRAME_NS * 1e-9:.0f} s")

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                frame = self._next_frame()
            except BadDeviceData as error:
                self._queue.put(error)
            except Exception as error:  # the SDK's own, whatever they are: X_LINK_ERROR above all
                self._queue.end(DeviceLost(f"camera {self._name}: {error}"))
                return
            else:
                if frame is not None:
                    self._queue.put(frame)

    def _next_frame(self) -> RgbdFrame | None:
        """Return the next frame; None if there was none for a while, or it was not usable."""
        group = self._groups.get(_POLL)
        if group is None:
            return None
        t_arrival_ns = self._clock.now_ns()
        if not isinstance(group, dai.MessageGroup):
            raise BadDeviceData(f"camera {self._name}: expected a group of images, got {type(group).__name__}")
        color, depth = group["color"], group["depth"] if self._with_depth else None
        if not (isinstance(color, dai.ImgFrame) and (depth is None or isinstance(depth, dai.ImgFrame))):
            raise BadDeviceData(f"camera {self._name}: expected images, got {type(color).__name__}, {type(depth).__name__}")
        return self._converter.convert(color, depth, t_arrival_ns)


def _sdk_offset_ns(clock: Clock) -> int:
    """Return host monotonic time less the SDK's host time, from the quickest of some readings: others are interrupted."""
    sdk_clock: Any = dai.Clock
    readings = []
    for _ in range(_READINGS):
        before_ns = clock.now_ns()
        sdk_ns = nanoseconds(sdk_clock.now())
        after_ns = clock.now_ns()
        readings.append((after_ns - before_ns, (before_ns + after_ns) // 2 - sdk_ns))
    return min(readings)[1]


def connected_camera(name: str, mxid: str, settings: OakSettings, clock: Clock) -> OakCamera:
    """Return the driver of the camera with this id."""
    return OakCamera(name, ConnectedOak(mxid), settings, clock)
