"""Cameras on the USB, as the kernel sees them: also those that a vendor's library may not open."""

from dataclasses import dataclass
from pathlib import Path

_VENDORS = {"8086": "realsense", "03e7": "oak"}
_REALSENSE_PRODUCTS = ("0aa", "0ad", "0ae", "0af", "0b0", "0b3", "0b4", "0b5", "0b6")
_SUPER_SPEED_MBPS = 5000


@dataclass(frozen=True, slots=True)
class UsbCamera:
    """A camera as the kernel sees it.

    Attributes:
        family: "realsense" or "oak".
        product: Product string, or its id.
        where: Kernel name of the USB device ("2-1.4").
        mbps: Speed of the connection.
    """

    family: str
    product: str
    where: str
    mbps: float

    @property
    def is_slow(self) -> bool:
        """Whether it is not connected as USB 3. An OAK is slow until it is opened."""
        return self.mbps < _SUPER_SPEED_MBPS


def usb_cameras(root: Path = Path("/sys/bus/usb/devices")) -> list[UsbCamera]:
    """Return the RealSense and OAK cameras on the USB."""
    found = []
    for folder in sorted(root.glob("*")):
        vendor, product = _read(folder / "idVendor"), _read(folder / "idProduct")
        family = _VENDORS.get(vendor)
        if family is None or (family == "realsense" and not product.startswith(_REALSENSE_PRODUCTS)):
            continue
        speed = _read(folder / "speed")
        name = _read(folder / "product") or f"{vendor}:{product}"
        found.append(UsbCamera(family, name, folder.name, float(speed) if speed.replace(".", "").isdigit() else 0.0))
    return found


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
