"""SDK frames of two streams to `RgbdFrame`s in a queue."""

import threading
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from ghest_drivers.errors import BadDeviceData
from ghest_drivers.hardware.cameras.frame_queue import FrameQueue
from ghest_drivers.hardware.cameras.numbering import FrameNumbering
from ghest_drivers.hardware.cameras.pairing import Image, Pair, Pairer
from ghest_drivers.hardware.cameras.registration import DepthRegistration, registered_info
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.hardware.realsense.exposure import MidExposure
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.settings import RealsenseSettings
from ghest_drivers.hardware.realsense.source import Source
from ghest_drivers.hardware.realsense.timestamps import TimeDomain
from ghest_drivers.samples import CameraInfo, RgbdFrame

_SETTLED_S = 0.05


@dataclass(frozen=True, slots=True)
class _Raw:
    """An SDK frame on its way to being paired."""

    frame: Any
    number: int
    t_device_ns: int
    t_arrival_ns: int


class FrameAssembler:
    """Stamps, pairs, converts and queues. Thread-safe: the SDK calls with one thread per sensor.

    Args:
        measured: The camera as it measures, before registration.
        source: Gives the stream clocks.
        settings: Rate, exposure and whether depth is registered.
        queue: Where finished frames go.
        stats: What happened.
    """

    def __init__(
        self, measured: CameraInfo, source: Source, settings: RealsenseSettings, queue: FrameQueue, stats: CameraStats
    ) -> None:
        self._shapes = {
            rs.stream.color: ((measured.color.height_px, measured.color.width_px, 3), np.dtype(np.uint8)),
            rs.stream.depth: ((measured.depth.height_px, measured.depth.width_px), np.dtype(np.uint16)),
        }
        align = settings.depth and settings.align
        self._registration = DepthRegistration(measured) if align else None
        self.info = registered_info(measured) if align else measured
        self._with_depth = settings.depth
        self._recorded_times = source.lossless
        self._clocks = {stream: source.stream_clock(settings.period_ns) for stream in self._shapes}
        self._mid_exposure = MidExposure(settings)
        self._pairer: Pairer[_Raw] = (
            Pairer(settings.period_ns, stats) if settings.depth else Pairer(settings.period_ns, stats, patience=0)
        )
        self._numbering = FrameNumbering(stats)
        self._queue = queue
        self._stats = stats
        self._lock = threading.Lock()
        self._counting = threading.Lock()
        self._calls = 0
        self._running = 0
        self._last_arrival_ns = 0

    def take(self, frame: Any, t_arrival_ns: int) -> None:
        """Take in a frame of either stream as it arrives."""
        self._count_calls(1)
        try:
            with self._lock:
                self._take(frame, t_arrival_ns)
        finally:
            self._count_calls(-1)

    def finish(self) -> None:
        """Wait until the SDK has handed over what it still holds; then hand on what waits for its depth image.

        The end of a file is told while its last frames are on their way.
        """
        while True:
            calls = self._calls
            time.sleep(_SETTLED_S)
            if self._running == 0 and self._calls == calls:
                break
        with self._lock:
            for pair in self._pairer.flush():
                self._deliver(pair)

    def _count_calls(self, running: int) -> None:
        with self._counting:
            self._calls += 1
            self._running += running

    def _take(self, frame: Any, t_arrival_ns: int) -> None:
        stream = frame.get_profile().stream_type()
        image = self._stamp(frame, stream, t_arrival_ns)
        if image is None:
            return
        pairs = self._pairer.add_color(image) if stream == rs.stream.color else self._pairer.add_depth(image)
        for pair in pairs:
            self._deliver(pair)

    def _stamp(self, frame: Any, stream: Any, t_arrival_ns: int) -> Image[_Raw] | None:
        t_device_ns = round(frame.get_timestamp() * 1e6)
        domain = TimeDomain(frame.get_frame_timestamp_domain().name)
        t_capture_ns = self._clocks[stream].capture_ns(t_device_ns, domain, t_arrival_ns, self._mid_exposure.offset_ns(frame))
        if t_capture_ns is None:
            self._stats.clock_suspect += 1
            return None
        frame.keep()
        return Image(t_capture_ns, _Raw(frame, frame.get_frame_number(), t_device_ns, t_arrival_ns))

    def _deliver(self, pair: Pair[_Raw]) -> None:
        color, depth = pair.color, pair.depth or pair.color
        seq = self._numbering.next(color.payload.number)
        try:
            color_rgb = self._pixels(color.payload, rs.stream.color)
            depth_counts = self._pixels(pair.depth.payload, rs.stream.depth) if pair.depth else None
        except BadDeviceData as error:
            self._stats.bad += 1
            self._queue.put(error)
            return
        if depth_counts is None:
            self._stats.without_depth += self._with_depth
        elif self._registration is not None:
            depth_counts = self._registration.apply(depth_counts)
        if self._recorded_times:
            t_arrival_ns = max(color.t_capture_ns, depth.t_capture_ns)
        else:
            t_arrival_ns = max(color.payload.t_arrival_ns, depth.payload.t_arrival_ns, self._last_arrival_ns)
            self._last_arrival_ns = t_arrival_ns
        self._stats.delivered += 1
        self._queue.put(
            RgbdFrame(
                info=self.info,
                seq=seq,
                color_rgb=color_rgb,
                depth_counts=depth_counts,
                t_device_ns=color.payload.t_device_ns,
                t_arrival_ns=t_arrival_ns,
                t_capture_ns=color.t_capture_ns,
                t_depth_capture_ns=depth.t_capture_ns,
            )
        )

    def _pixels(self, raw: _Raw, stream: Any) -> Any:
        shape, dtype = self._shapes[stream]
        pixels = np.array(raw.frame.get_data())
        if pixels.shape != shape or pixels.dtype != dtype:
            raise BadDeviceData(
                f"camera {self.info.name}: {stream.name} frame {raw.number} is {pixels.dtype} {pixels.shape}, "
                f"not {dtype} {shape}"
            )
        return pixels
