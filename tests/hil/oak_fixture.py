"""An OAK camera's host part on the vendor's own pipeline and message types, under the product's supervisor and driver."""

from datetime import timedelta
from typing import Any

import numpy as np

from ghest_drivers.clock import Clock
from ghest_drivers.hardware.supervisor.camera import SupervisedCamera
from ghest_drivers.hardware.supervisor.link import Limits
from ghest_drivers.hardware.supervisor.protocol import BackendSpec
from ghest_drivers.interfaces import RgbdCamera
from tests.hil.camera_feeder import CameraFeeder
from tests.hil.injection import hil_folder


def supervised(*, name: str, clock: Clock, watchdog_ms: int = 500, supervised: bool = True, **settings: Any) -> RgbdCamera:
    """What the factory makes for `backend = "oak"`, with the device's part of the pipeline replaced."""
    from ghest_drivers.hardware.cameras.frozen import FrozenWatch

    spec = BackendSpec(__name__, "here", settings)
    return FrozenWatch(SupervisedCamera(name, spec, clock, Limits(silence_s=watchdog_ms * 1e-3)))


def here(*, name: str, clock: Clock, mxid: str, **streams: Any) -> RgbdCamera:
    """The driver in this process, on queues that the feeder feeds."""
    import depthai as dai

    from ghest_drivers.hardware.oak.camera import OakCamera
    from ghest_drivers.hardware.oak.settings import OakSettings
    from ghest_drivers.hardware.oak.source import Images

    feeder = CameraFeeder(hil_folder(), name)
    scene = feeder.scene
    pinhole = scene.intrinsics

    class HostSource:
        """In place of the nodes that run on a device."""

        def connect(self, settings: OakSettings) -> tuple[Images, Any]:
            self.pipeline = pipeline = dai.Pipeline(createImplicitDevice=False)
            sync = pipeline.create(dai.node.Sync)
            self.color = sync.inputs["color"].createInputQueue()
            self.depth = sync.inputs["depth"].createInputQueue()
            feeder.start(self.send)
            return Images(pipeline, "OAK-D-SR", mxid), sync

        def send(self, view: str, index: int, number: int, t_ns: int) -> None:
            if not self.pipeline.isRunning():  # images that wait while it starts may make the SDK hang
                return
            stamp = timedelta(microseconds=t_ns / 1000)  # the SDK's host clock is CLOCK_MONOTONIC as well
            self.color.send(image(scene.color[view][index], dai.ImgFrame.Type.RGB888i, number, stamp))
            self.depth.send(image(scene.depth[view][index], dai.ImgFrame.Type.RAW16, number, stamp))

        def temperature_c(self) -> float:
            return 41.0

        def release(self) -> None:
            """Nothing to release."""

    def image(pixels: np.ndarray, kind: Any, number: int, stamp: timedelta) -> Any:
        out = dai.ImgFrame()
        out.setType(kind)
        out.setWidth(pixels.shape[1])
        out.setHeight(pixels.shape[0])
        out.setData(np.ascontiguousarray(pixels).view(np.uint8).ravel())
        out.setSequenceNum(number)
        out.setTimestamp(stamp)
        out.setTimestampDevice(stamp + timedelta(seconds=5))
        out.setTransformation(
            dai.ImgTransformation(
                pinhole.width_px, pinhole.height_px, pinhole.matrix.tolist(), dai.CameraModel.Perspective, [0.0] * 14
            )
        )
        return out

    return OakCamera(name, HostSource(), OakSettings(**streams), clock)
