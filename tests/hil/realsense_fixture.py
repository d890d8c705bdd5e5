"""A RealSense SR300 in software, under the product's own supervisor, driver and vendor library."""

import time
from typing import Any

import numpy as np

from ghest_drivers.clock import Clock
from ghest_drivers.hardware.supervisor.camera import SupervisedCamera
from ghest_drivers.hardware.supervisor.link import Limits
from ghest_drivers.hardware.supervisor.protocol import BackendSpec
from ghest_drivers.interfaces import RgbdCamera
from ghest_drivers.samples import CameraInfo
from tests.hil.camera_feeder import CameraFeeder
from tests.hil.injection import hil_folder
from tests.hil.scene import DEPTH_UNIT_M, FRAME_RATE_HZ

_CLOCK_AHEAD_NS = 3_000_000_000_000  # the device has been on for 50 minutes longer than the host


def supervised(*, name: str, clock: Clock, watchdog_ms: int = 500, supervised: bool = True, **settings: Any) -> RgbdCamera:
    """What the factory makes for `backend = "realsense"`, with the device in software."""
    from ghest_drivers.hardware.cameras.frozen import FrozenWatch

    spec = BackendSpec(__name__, "here", settings)
    return FrozenWatch(SupervisedCamera(name, spec, clock, Limits(silence_s=watchdog_ms * 1e-3)))


def here(
    *, name: str, clock: Clock, serial: str, latency_ms: float | None = None, record_bag: None = None, **streams: Any
) -> RgbdCamera:
    """The driver in this process, on a device that the feeder feeds."""
    from ghest_drivers.hardware.realsense.camera import RealsenseCamera
    from ghest_drivers.hardware.realsense.settings import RealsenseSettings
    from ghest_drivers.hardware.realsense.software import SoftwareRealsense
    from ghest_drivers.hardware.realsense.source import ConnectedDevice
    from ghest_drivers.hardware.realsense.timestamps import TimeDomain

    feeder = CameraFeeder(hil_folder(), name)
    scene = feeder.scene
    pinhole = scene.intrinsics
    info = CameraInfo(name, "Intel RealSense SR300", serial, pinhole, pinhole, DEPTH_UNIT_M, np.eye(4), float(FRAME_RATE_HZ))
    exposure = {"exposure": (1.0, 330.0, 80.0)}
    device = SoftwareRealsense(info, color_options=exposure)
    settings = RealsenseSettings(latency_ns=None if latency_ms is None else round(latency_ms * 1e6), **streams)
    half_exposure_ns = 0 if settings.exposure_us is None else settings.exposure_us * 500
    camera = RealsenseCamera(
        name, ConnectedDevice(serial, settings.latency_ns, time.time_ns), settings, clock, context=device.context
    )

    def send(view: str, index: int, number: int, t_ns: int) -> None:
        # Stamped at the end of the exposure by the device's own clock, which runs 20 ppm fast, in whole microseconds.
        t_device_ns = round((t_ns + half_exposure_ns - scene.epoch_ns + _CLOCK_AHEAD_NS) * 1.00002)
        t_device_ns = (t_device_ns + feeder.clock.off_ns(t_ns)) // 1000 * 1000
        device.send_depth(scene.depth[view][index], number, t_device_ns, TimeDomain.HARDWARE)
        device.send_color(scene.color[view][index], number, t_device_ns, TimeDomain.HARDWARE)

    feeder.start(send)
    return camera
