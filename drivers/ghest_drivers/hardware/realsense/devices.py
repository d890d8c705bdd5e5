"""Which RealSense devices there are, told without starting any."""

from dataclasses import dataclass
from typing import Any

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.hardware.realsense.sdk import rs

_POLL_NS = 200_000_000


@dataclass(frozen=True, slots=True)
class RealsenseDevice:
    """One connected device.

    Attributes:
        model: Its name.
        serial: Serial number, by which the station file chooses it.
        firmware: Firmware version, or "".
        usb: USB version of the connection ("3.2"), or "": below 3 there is no 60 Hz.
    """

    model: str
    serial: str
    firmware: str
    usb: str


def describe(device: Any) -> RealsenseDevice:
    """Return the facts about an SDK device."""
    info = rs.camera_info
    return RealsenseDevice(
        model=_info(device, info.name).rpartition("\n")[2],  # software devices say so on a line of their own
        serial=_info(device, info.serial_number),
        firmware=_info(device, info.firmware_version),
        usb=_info(device, info.usb_type_descriptor),
    )


def list_devices() -> tuple[RealsenseDevice, ...]:
    """Return what is connected now; takes milliseconds."""
    return tuple(describe(device) for device in rs.context().query_devices())


def find_device(context: Any, serial: str) -> Any:
    """Return the SDK device with this serial number.

    Raises:
        DeviceNotFound: It is not connected; says which are.
    """
    present = []
    for device in context.query_devices():
        if _info(device, rs.camera_info.serial_number) == serial:
            return device
        facts = describe(device)
        present.append(f"{facts.model} {facts.serial}")
    raise DeviceNotFound(
        f"no RealSense camera with serial number {serial}; connected: {', '.join(sorted(present)) or 'none'}. "
        "Check the cable and the serial number in the station file"
    )


def reset_device(context: Any, serial: str, clock: Clock, timeout_ns: int = 10_000_000_000) -> None:
    """Reset a device and wait until it has come back.

    Raises:
        DeviceNotFound: It was not there, or did not come back in time.
    """
    find_device(context, serial).hardware_reset()
    deadline_ns = clock.now_ns() + timeout_ns
    gone = False
    while clock.now_ns() < deadline_ns:
        clock.sleep_until_ns(clock.now_ns() + _POLL_NS)
        present = any(_info(device, rs.camera_info.serial_number) == serial for device in context.query_devices())
        if gone and present:
            return
        gone = gone or not present
    if not gone:  # it came back faster than was looked
        return
    raise DeviceNotFound(f"RealSense camera {serial} did not come back after a reset: unplug it and plug it in again")


def _info(device: Any, key: Any) -> str:
    return str(device.get_info(key)) if device.supports(key) else ""
