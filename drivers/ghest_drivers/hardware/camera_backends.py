"""Hardware cameras as the factory makes them, from the settings of a station file.

Nothing here imports a vendor library before it is needed: a supervised camera's is imported in its own process only.
"""

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ghest_drivers.clock import Clock
from ghest_drivers.hardware.cameras.frozen import FrozenWatch
from ghest_drivers.hardware.oak.settings import OakSettings
from ghest_drivers.hardware.realsense.settings import RealsenseSettings
from ghest_drivers.hardware.supervisor.camera import SupervisedCamera
from ghest_drivers.hardware.supervisor.link import Limits
from ghest_drivers.hardware.supervisor.protocol import BackendSpec
from ghest_drivers.interfaces import RgbdCamera


def realsense(*, name: str, clock: Clock, supervised: bool = True, watchdog_ms: int = 500, **settings: object) -> RgbdCamera:
    """Return the driver of a connected RealSense camera.

    Args:
        name: The camera's name in the station file.
        clock: Host clock.
        supervised: Whether the vendor's code runs in a process of its own.
        watchdog_ms: How long that process may send no frame.
        settings: `serial`, and the fields of `RealsenseSettings` (`latency_ms` in place of `latency_ns`).
    """
    return FrozenWatch(_make(realsense_here, name, clock, settings, watchdog_ms if supervised else None))


def realsense_bag(
    *, name: str, clock: Clock, supervised: bool = False, watchdog_ms: int = 500, **settings: object
) -> RgbdCamera:
    """Return a camera that plays back a .bag file: `path`, `real_time`, and stream settings; otherwise as `realsense`."""
    return _make(realsense_bag_here, name, clock, settings, watchdog_ms if supervised else None)


def oak(*, name: str, clock: Clock, supervised: bool = True, watchdog_ms: int = 500, **settings: object) -> RgbdCamera:
    """Return the driver of a connected OAK camera: `mxid`, and the fields of `OakSettings`; otherwise as `realsense`."""
    return FrozenWatch(_make(oak_here, name, clock, settings, watchdog_ms if supervised else None))


def realsense_here(
    *, name: str, clock: Clock, serial: str, latency_ms: float | None = None, record_bag: str | None = None, **streams: Any
) -> RgbdCamera:
    """Return the RealSense driver in this process."""
    driver: Any = importlib.import_module("ghest_drivers.hardware.realsense.camera")
    latency_ns = None if latency_ms is None else round(latency_ms * 1e6)
    settings = RealsenseSettings(record_bag=Path(record_bag) if record_bag else None, latency_ns=latency_ns, **streams)
    camera: RgbdCamera = driver.connected_camera(name, serial, settings, clock)
    return camera


def realsense_bag_here(*, name: str, clock: Clock, path: str, real_time: bool = True, **streams: Any) -> RgbdCamera:
    """Return the .bag player in this process."""
    driver: Any = importlib.import_module("ghest_drivers.hardware.realsense.camera")
    camera: RgbdCamera = driver.bag_camera(name, Path(path), RealsenseSettings(**streams), clock, real_time=real_time)
    return camera


def oak_here(*, name: str, clock: Clock, mxid: str, **streams: Any) -> RgbdCamera:
    """Return the OAK driver in this process."""
    driver: Any = importlib.import_module("ghest_drivers.hardware.oak.camera")
    camera: RgbdCamera = driver.connected_camera(name, mxid, OakSettings(**streams), clock)
    return camera


def _make(
    maker: Callable[..., RgbdCamera], name: str, clock: Clock, settings: Mapping[str, object], watchdog_ms: int | None
) -> RgbdCamera:
    if watchdog_ms is None:
        return maker(name=name, clock=clock, **settings)
    spec = BackendSpec(maker.__module__, maker.__name__, dict(settings))
    return SupervisedCamera(name, spec, clock, Limits(silence_s=watchdog_ms * 1e-3))
