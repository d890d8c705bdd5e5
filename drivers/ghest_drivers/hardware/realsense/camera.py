"""The RealSense drivers: a connected camera, or a .bag file in its place."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ghest_drivers.clock import Clock
from ghest_drivers.hardware.cameras.session_camera import SessionCamera
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.session import Session
from ghest_drivers.hardware.realsense.settings import RealsenseSettings
from ghest_drivers.hardware.realsense.source import BagFile, ConnectedDevice, Source


class RealsenseCamera(SessionCamera[Session]):
    """An `RgbdCamera` on the RealSense SDK.

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
        super().__init__(name)
        self._source = source
        self._settings = settings
        self._clock = clock
        self._make_context = context

    def _start(self) -> Session:
        return Session(self._name, self._make_context(), self._source, self._settings, clock=self._clock, stats=self.stats)

    def reset(self) -> None:
        """Reset the closed device and wait until it is back.

        Raises:
            DeviceNotFound: It is not there, or did not come back.
        """
        self._source.reset(self._make_context(), self._clock)


def connected_camera(name: str, serial: str, settings: RealsenseSettings, clock: Clock) -> RealsenseCamera:
    """Return the driver of the camera with this serial number."""
    return RealsenseCamera(name, ConnectedDevice(serial, settings.latency_ns, time.time_ns), settings, clock)


def bag_camera(name: str, path: Path, settings: RealsenseSettings, clock: Clock, *, real_time: bool = True) -> RealsenseCamera:
    """Return a camera that plays back a .bag file."""
    return RealsenseCamera(name, BagFile(path, real_time=real_time), settings, clock)
