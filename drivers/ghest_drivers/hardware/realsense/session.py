"""One opened RealSense camera: from `open` to `close`."""

import logging
import threading
from typing import Any

import numpy as np

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceLost, DeviceNotFound, DriverError, EndOfStream
from ghest_drivers.hardware.cameras.frame_queue import FrameQueue
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.hardware.realsense.assembly import FrameAssembler
from ghest_drivers.hardware.realsense.calibration import intrinsics_from_sdk, transform_from_sdk
from ghest_drivers.hardware.realsense.devices import describe
from ghest_drivers.hardware.realsense.options import apply_options
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.settings import RealsenseSettings
from ghest_drivers.hardware.realsense.source import Source
from ghest_drivers.hardware.realsense.streams import Mode, Stream, depth_unit_m, find_stream, group_by_sensor
from ghest_drivers.samples import CameraInfo, RgbdFrame

_log = logging.getLogger(__name__)
_END_POLL_S = 0.05
_NO_DEPTH_UNIT_M = 0.001  # of a camera without depth images: anything


class Session:
    """Sensors streaming into a queue.

    Raises:
        DeviceNotFound: No such device, or it cannot be started.
        DriverError: It lacks the mode or an option asked for.
        BadDeviceData: Its calibration cannot be used.
    """

    def __init__(
        self, name: str, context: Any, source: Source, settings: RealsenseSettings, *, clock: Clock, stats: CameraStats
    ) -> None:
        self._name = name
        self._context = context
        self._source = source
        self._queue = FrameQueue(settings.queue_frames, stats, lossless=source.lossless)
        self._groups: list[tuple[Any, list[Any]]] = []
        self._closing = threading.Event()
        self._watcher: threading.Thread | None = None
        self._device = source.acquire(context)
        try:
            self.info = self._start(settings, clock, stats)
        except RuntimeError as error:
            self.close()
            raise DeviceNotFound(f"camera {name} cannot be started ({error}): is another program using it?") from error
        except DriverError:
            self.close()
            raise

    def read(self, timeout_s: float) -> RgbdFrame:
        """Return the next frame; see `RgbdCamera.read`."""
        return self._queue.get(timeout_s)

    def temperature_c(self) -> float | None:
        """See `CameraSession.temperature_c`."""
        for sensor, _ in self._groups:
            if sensor.supports(rs.option.asic_temperature):
                try:
                    return float(sensor.get_option(rs.option.asic_temperature))
                except RuntimeError as error:  # busy, or gone: the frames tell
                    _log.debug("camera %s: temperature: %s", self._name, error)
        return None

    def close(self) -> None:
        """Stop and let go of every SDK object, so that the device, or the file being recorded, is closed."""
        self._queue.close()  # first: a full lossless queue holds the SDK's threads
        self._closing.set()
        if self._watcher is not None:
            self._watcher.join()
        if not self._source.finite:
            self._context.set_devices_changed_callback(_ignore)
        for sensor, _ in self._groups:
            for step in (sensor.stop, sensor.close):
                try:
                    step()
                except RuntimeError as error:  # never started, or gone
                    _log.debug("camera %s: %s: %s", self._name, step.__name__, error)
        self._groups = []
        self._device = None
        self._source.release(self._context)

    def _start(self, settings: RealsenseSettings, clock: Clock, stats: CameraStats) -> CameraInfo:
        if settings.record_bag is not None:
            self._device = rs.recorder(str(settings.record_bag), self._device)
        sensors = list(self._device.query_sensors())
        color, depth = _streams(sensors, settings)
        if not self._source.finite:
            apply_options(color.sensor, None if depth is None else depth.sensor, settings)
        measured = self._describe(sensors, color, depth, settings)
        assembler = FrameAssembler(measured, self._source, settings, self._queue, stats)
        if not self._source.finite:
            self._watch_for_unplugging()
        self._groups = group_by_sensor((color,) if depth is None else (color, depth))
        for sensor, profiles in self._groups:
            sensor.open(profiles)
        on_frame = _callback(self._name, assembler, self._queue, clock)
        if self._source.finite:
            self._device.pause()  # playing begins with the first sensor started: the others would miss their first frames
        for sensor, _ in self._groups:
            sensor.start(on_frame)
        if self._source.finite:
            self._device.resume()
            self._watcher = threading.Thread(
                target=self._watch_for_end, args=(assembler,), name=f"end-{self._name}", daemon=True
            )
            self._watcher.start()
        return assembler.info

    def _describe(self, sensors: list[Any], color: Stream, depth: Stream | None, settings: RealsenseSettings) -> CameraInfo:
        facts = describe(self._device)
        intrinsics = intrinsics_from_sdk(color.profile.get_intrinsics(), is_depth=False)
        return CameraInfo(
            name=self._name,
            model=facts.model,
            serial=facts.serial,
            color=intrinsics,
            depth=intrinsics if depth is None else intrinsics_from_sdk(depth.profile.get_intrinsics(), is_depth=True),
            depth_unit_m=_NO_DEPTH_UNIT_M if depth is None else depth_unit_m(sensors),
            color_from_depth=np.eye(4) if depth is None else transform_from_sdk(depth.profile.get_extrinsics_to(color.profile)),
            rate_hz=float(settings.rate_hz),
        )

    def _watch_for_unplugging(self) -> None:
        queue, device, name = self._queue, self._device, self._name

        def on_change(change: Any) -> None:
            if change.was_removed(device):
                queue.end(DeviceLost(f"camera {name} was unplugged"))

        self._context.set_devices_changed_callback(on_change)

    def _watch_for_end(self, assembler: FrameAssembler) -> None:
        """Look for the end of the file. The SDK's own call-back on it can deadlock with the calls that cause it."""
        while not self._closing.wait(_END_POLL_S):
            if self._device.current_status() == rs.playback_status.stopped:
                assembler.finish()
                self._queue.end(EndOfStream(f"camera {self._name}: the recording is through"))
                return


def _streams(sensors: list[Any], settings: RealsenseSettings) -> tuple[Stream, Stream | None]:
    width_px, height_px = settings.width_px, settings.height_px
    color = Mode(rs.stream.color, rs.format.rgb8, width_px, height_px, settings.rate_hz)
    if not settings.depth:
        return find_stream(sensors, color), None
    depth_size = (settings.depth_width_px or width_px, settings.depth_height_px or height_px)
    depth = Mode(rs.stream.depth, rs.format.z16, *depth_size, settings.rate_hz)
    return find_stream(sensors, color), find_stream(sensors, depth)


def _callback(name: str, assembler: FrameAssembler, queue: FrameQueue, clock: Clock) -> Any:
    """Return what the SDK calls for every frame. It holds no SDK object, so that none keeps itself alive."""

    def on_frame(frame: Any) -> None:
        t_arrival_ns = clock.now_ns()
        try:
            assembler.take(frame, t_arrival_ns)
        except Exception as error:  # none may reach the SDK's thread
            _log.exception("camera %s", name)
            queue.end(DeviceLost(f"camera {name}: {error}"))

    return on_frame


def _ignore(change: Any) -> None:
    """Stand in for the callback that knew the session."""
