"""In place of an OAK device: queues into the same Sync node, on the SDK's own pipeline."""

import threading
from datetime import timedelta
from typing import Any

import numpy as np

from ghest_drivers.hardware.oak.sdk import dai
from ghest_drivers.hardware.oak.settings import OakSettings
from ghest_drivers.hardware.oak.source import Images

WIDTH, HEIGHT = 64, 48
SETTINGS = OakSettings(width_px=WIDTH, height_px=HEIGHT, rate_hz=60, queue_frames=16)
PERIOD = timedelta(microseconds=16_667)
_START_S = 0.02  # the pipeline says that it runs before all its nodes do
MATRIX = [[60.0, 0.0, 31.5], [0.0, 61.0, 23.5], [0.0, 0.0, 1.0]]


def image(pixels: Any, number: int, t: timedelta, distortion: list[float] | None = None) -> Any:
    """A colour or depth message as a device would send it; its clock started 5 s after the host's."""
    out = dai.ImgFrame()
    out.setType(dai.ImgFrame.Type.RGB888i if pixels.ndim == 3 else dai.ImgFrame.Type.RAW16)
    out.setWidth(pixels.shape[1])
    out.setHeight(pixels.shape[0])
    out.setData(np.ascontiguousarray(pixels).view(np.uint8).ravel())
    out.setSequenceNum(number)
    out.setTimestamp(t)
    out.setTimestampDevice(t - timedelta(seconds=5))
    out.setTransformation(
        dai.ImgTransformation(pixels.shape[1], pixels.shape[0], MATRIX, dai.CameraModel.Perspective, distortion or [0.0] * 14)
    )
    return out


def color_of(k: int) -> Any:
    rows = np.arange(HEIGHT, dtype=np.uint8)[:, None, None]
    return np.broadcast_to(rows + np.array([k, 2, 3], np.uint8), (HEIGHT, WIDTH, 3)).astype(np.uint8)


def depth_of(k: int) -> Any:
    return (1000 * k + np.arange(HEIGHT * WIDTH)).astype(np.uint16).reshape(HEIGHT, WIDTH)


class HostSource:
    """In place of a device: queues into the same Sync node.

    Like a device's, its first image comes after the pipeline has started: with some waiting, the start now and then hangs.

    Attributes:
        live: Set from the first image until it is released.
    """

    def __init__(self) -> None:
        self.released = 0
        self.live = threading.Event()
        self._released = threading.Event()
        self._beginning: threading.Thread | None = None

    def connect(self, settings: OakSettings) -> tuple[Images, Any]:
        self.pipeline = dai.Pipeline(createImplicitDevice=False)
        sync = self.pipeline.create(dai.node.Sync)
        self.color = sync.inputs["color"].createInputQueue()
        if settings.depth:
            self.depth = sync.inputs["depth"].createInputQueue()
        self.started = dai.Clock.now()
        self._released.clear()
        self._beginning = threading.Thread(target=self._begin, args=(self.pipeline, "cd" if settings.depth else "c"))
        self._beginning.start()
        return Images(self.pipeline, "OAK-D-SR", "1844"), sync

    def _begin(self, pipeline: Any, streams: str) -> None:
        while not self._released.wait(_START_S):
            if pipeline.isRunning():
                self.send(0, streams=streams)
                self.live.set()
                return

    def send(self, k: int, *, skew: timedelta = timedelta(), streams: str = "cd") -> None:
        t = self.started + k * PERIOD - timedelta(milliseconds=100)
        if "c" in streams:
            self.color.send(image(color_of(k), 500 + k, t))
        if "d" in streams:
            self.depth.send(image(depth_of(k), 3 * k, t + skew))

    def temperature_c(self) -> float:
        return 41.0

    def release(self) -> None:
        self.live.clear()
        self._released.set()
        if self._beginning is not None:
            self._beginning.join()
        self.released += 1
