"""The RealSense drivers: a connected camera, or a .bag file in its place."""

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceLost
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.session import Session
from ghest_drivers.hardware.realsense.settings import RealsenseSettings
from ghest_drivers.hardware.realsense.source import BagFile, ConnectedDevice, Source
from ghest_drivers.samples import CameraInfo, RgbdFrame

_log = logging.getLogger(__name__)


class RealsenseCamera:
    """An `RgbdCamera` on the RealSense SDK.

    The vendor's code runs in this process: for live use wrap it in a `SupervisedCamera`.

    Args:
        name: The camera's name in the station file.
        source: Where frames come from.
        settings: Streams and options.
        clock: Host clock.
        context: Makes the SDK context; devices are looked for there.
    """

    def __init__(
        self,
        name: str,
        source: Source,
        settings: RealsenseSettings,
        clock: Clock,
        context: Callable[[], Any] = rs.context,
    ) -> None:
        self._name = name
        self._source = source
        self._settings = settings
        self._clock = clock
        self._make_context = context
        self._session: Session | None = None
        self._lock = threading.Lock()
        self.stats = CameraStats()

    @property
    def info(self) -> CameraInfo:
        """See `RgbdCamera.info`."""
        return self._opened().info

    def open(self) -> None:
        """See `RgbdCamera.open`; also raises DriverError where the device lacks what the settings ask for."""
        with self._lock:
            if self._session is None:
                self._session = Session(
                    self._name, self._make_context(), self._source, self._settings, clock=self._clock, stats=self.stats
                )

    def read(self, timeout_s: float) -> RgbdFrame:
        """See `RgbdCamera.read`."""
        return self._opened().read(timeout_s)

    def close(self) -> None:
        """See `RgbdCamera.close`."""
        with self._lock:
            session, self._session = self._session, None
        if session is not None:
            session.close()
            _log.info("camera %s: %s", self._name, self.stats.summary())

    def reset(self) -> None:
        """Reset the closed device and wait until it is back.

        Raises:
            DeviceNotFound: It is not there, or did not come back.
        """
        self._source.reset(self._make_context(), self._clock)

    def _opened(self) -> Session:
        session = self._session
        if session is None:
            raise DeviceLost(f"camera {self._name} is not open")
        return session


def connected_camera(name: str, serial: str, settings: RealsenseSettings, clock: Clock) -> RealsenseCamera:
    """Return the driver of the camera with this serial number."""
    return RealsenseCamera(name, ConnectedDevice(serial, settings.latency_ns, time.time_ns), settings, clock)


def bag_camera(name: str, path: Path, settings: RealsenseSettings, clock: Clock, *, real_time: bool = True) -> RealsenseCamera:
    """Return a camera that plays back a .bag file."""
    return RealsenseCamera(name, BagFile(path, real_time=real_time), settings, clock)
