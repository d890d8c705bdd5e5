"""Backends by name. A backend's module, and with it its vendor library, is imported only when it is chosen.

A further backend is one more line in a table: the module and the callable that makes the device, called with keywords
(`clock`, for cameras also `name`, and the backend's own settings), and the extra of ghest-rt that brings its library.
"""

import importlib
import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.installing import pip_install
from ghest_drivers.interfaces import EncoderLink, RgbdCamera


@dataclass(frozen=True, slots=True)
class Backend:
    """Where a backend is.

    Attributes:
        module: Its module's dotted path.
        maker: The callable in it.
        extra: The extra of ghest-rt that installs what it needs; "" if nothing.
        libraries: The top-level modules that the extra brings and without which the device can never open.
    """

    module: str
    maker: str
    extra: str = ""
    libraries: tuple[str, ...] = ()


CAMERAS: dict[str, Backend] = {
    "sim": Backend("ghest_drivers.sim", "SimCamera", "sim"),
    "realsense": Backend("ghest_drivers.hardware.camera_backends", "realsense", "realsense", ("pyrealsense2",)),
    "realsense_bag": Backend("ghest_drivers.hardware.camera_backends", "realsense_bag", "realsense", ("pyrealsense2",)),
    "oak": Backend("ghest_drivers.hardware.camera_backends", "oak", "oak", ("depthai",)),
}
ENCODERS: dict[str, Backend] = {
    "sim": Backend("ghest_drivers.sim", "SimEncoders", "sim"),
    "serial": Backend("ghest_drivers.hardware.encoders.serial_link", "SerialEncoderLink", "serial", ("serial",)),
    "can": Backend("ghest_drivers.hardware.encoders.can_link", "CanEncoderLink", "can", ("can", "cantools")),
    "can_log": Backend("ghest_drivers.hardware.encoders.can_log", "can_log_link", "can", ("can", "cantools")),
    "canopen": Backend("ghest_drivers.hardware.encoders.canopen_link", "CanopenEncoderLink", "can", ("can", "canopen")),
    "armeo": Backend("ghest_drivers.hardware.encoders.armeo_export", "armeo_link"),
}


def make_camera(backend: str, name: str, clock: Clock, settings: Mapping[str, object]) -> RgbdCamera:
    """Make a camera, not yet open.

    Args:
        backend: A name in `CAMERAS`.
        name: The camera's name in the station file.
        clock: Host clock.
        settings: The backend's own keyword arguments.

    Raises:
        DeviceNotFound: No such backend, or its library is not installed: names the extra to install.
        TypeError: The backend does not know a setting.
    """
    camera: RgbdCamera = _make("camera", CAMERAS, backend, {**settings, "name": name, "clock": clock})
    return camera


def make_encoders(backend: str, clock: Clock, settings: Mapping[str, object]) -> EncoderLink:
    """Make an encoder link, not yet open.

    Args:
        backend: A name in `ENCODERS`.
        clock: Host clock.
        settings: The backend's own keyword arguments.

    Raises:
        DeviceNotFound: No such backend, or its library is not installed: names the extra to install.
        TypeError: The backend does not know a setting.
    """
    encoders: EncoderLink = _make("encoder", ENCODERS, backend, {**settings, "clock": clock})
    return encoders


def _make(what: str, table: Mapping[str, Backend], name: str, arguments: Mapping[str, object]) -> Any:
    backend = table.get(name)
    if backend is None:
        raise DeviceNotFound(f"no {what} backend {name!r}; there are {', '.join(sorted(table))}")
    # Found out here, not when the device opens: a device may come back, a library will not, so nobody should wait for it.
    missing = [library for library in backend.libraries if importlib.util.find_spec(library) is None]
    if missing:
        raise DeviceNotFound(f"{what} backend {name} needs {', '.join(missing)}: {pip_install(backend.extra)}")
    try:
        module = importlib.import_module(backend.module)
    except ImportError as error:
        raise DeviceNotFound(f"{what} backend {name} lacks a library ({error}): {pip_install(backend.extra)}") from error
    return getattr(module, backend.maker)(**arguments)
