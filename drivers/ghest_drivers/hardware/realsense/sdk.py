"""The vendor library, or an error that says how to get it."""

from typing import Any

from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.installing import pip_install


def load_sdk() -> Any:
    """Return the module `pyrealsense2`.

    Raises:
        DeviceNotFound: It is not installed, or lacks a system library.
    """
    try:
        import pyrealsense2  # noqa: PLC0415 - only where this backend is chosen
    except ModuleNotFoundError as error:
        raise DeviceNotFound(f"the library for RealSense cameras is missing: {pip_install('realsense')}") from error
    except ImportError as error:
        raise DeviceNotFound(f"pyrealsense2 cannot be loaded ({error}): apt install libusb-1.0-0") from error
    return pyrealsense2


rs = load_sdk()
