"""What can go wrong with a device.

    DriverError
    ├── DeviceNotFound     no such device, or its vendor library is missing
    ├── DeviceLost         it was there and has gone, or does not answer
    ├── ReadTimeout        nothing new within the time asked for (the device may be well)
    ├── EndOfStream        a finite source (recording, finite simulation) is through
    └── BadDeviceData      the device sent what cannot be used

Samples that are merely implausible are not errors: they are rejected with an enum reason by whoever judges them.
"""


class DriverError(Exception):
    """Root of all driver errors; the message names the device and the remedy."""


class DeviceNotFound(DriverError):
    """No such device is connected, or the library that drives it is not installed."""


class DeviceLost(DriverError):
    """The device was open and stopped answering; re-opening may help."""


class ReadTimeout(DriverError):
    """No new sample arrived within the time asked for."""


class EndOfStream(DriverError):
    """The recording, or a simulation of finite length, holds no more samples."""


class BadDeviceData(DriverError):
    """The device sent something that cannot be decoded or has the wrong shape."""
