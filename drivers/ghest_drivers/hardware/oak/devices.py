"""Which OAK devices there are, told without starting any."""

from dataclasses import dataclass

from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.hardware.oak.sdk import dai


@dataclass(frozen=True, slots=True)
class OakDevice:
    """One connected device.

    Attributes:
        mxid: Its id, by which the station file chooses it.
        name: USB path or IP address.
        state: What it is doing, by the SDK's name ("X_LINK_UNBOOTED": free; "X_LINK_BOOTED": in use).
    """

    mxid: str
    name: str
    state: str


def list_devices() -> tuple[OakDevice, ...]:
    """Return what is connected now; takes half a second."""
    found = dai.Device.getAllAvailableDevices()
    return tuple(OakDevice(info.getDeviceId(), info.name, info.state.name) for info in found)


def find_device(mxid: str) -> "dai.DeviceInfo":
    """Return the SDK's description of the device with this id. Asked first, since opening an absent one blocks for 11 s.

    Raises:
        DeviceNotFound: It is not connected, or another program has it; says which are free.
    """
    found = dai.Device.getAllAvailableDevices()
    for info in found:
        if info.getDeviceId() == mxid:
            return info
    present = ", ".join(sorted(info.getDeviceId() for info in found)) or "none"
    raise DeviceNotFound(
        f"no free OAK camera with id {mxid}; free ones: {present}. "
        "Check the cable, the id in the station file, and whether another program has it"
    )
