"""Devices that are there, against those that a station needs."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ghest_drivers.hardware.probe import ProbeResult
from ghest_rt.cli.doctor.findings import Finding, missing, note, ok
from ghest_rt.cli.doctor.links import CanInterface, SerialPort, is_serial, may_open
from ghest_rt.cli.doctor.usb import UsbCamera
from ghest_rt.config.camera_devices import OakBackend, RealsenseBackend, RealsenseBagBackend
from ghest_rt.config.encoder_devices import (
    ArmeoBackend,
    CanBackend,
    CanBus,
    CanLogBackend,
    CanopenBackend,
    SerialBackend,
)
from ghest_rt.config.load import LoadedStation

_NAMES = {"realsense": "RealSense cameras", "oak": "OAK cameras"}
_UDEV = "install the vendor's udev rules (docs/hardware.md), unplug the camera and plug it in again"
_GROUP = "add the user to the group that owns it, usually: sudo usermod -aG dialout USER, then log in again"


@dataclass(frozen=True, slots=True)
class Present:
    """What is there.

    Attributes:
        cameras: By family, what the vendor's library sees.
        usb: Cameras that the kernel sees.
        ports: Serial ports.
        can: CAN interfaces.
    """

    cameras: Mapping[str, ProbeResult]
    usb: list[UsbCamera]
    ports: list[SerialPort]
    can: list[CanInterface]

    @property
    def has_camera(self) -> bool:
        """Whether a vendor's library sees a camera."""
        return any(result.devices for result in self.cameras.values())


def check_present(present: Present) -> Iterator[Finding]:
    """Say what is there."""
    for family, result in present.cameras.items():
        yield from _check_family(family, result, [camera for camera in present.usb if camera.family == family])
    ports = ", ".join(port.path + ("" if port.permitted else " (not permitted)") for port in present.ports)
    yield ok("serial ports", ports) if ports else note("serial ports", "none", "connect the encoder box")
    can = ", ".join(interface.name + ("" if interface.is_up else " (down)") for interface in present.can)
    yield ok("CAN interfaces", can) if can else note("CAN interfaces", "none", "connect the CAN adapter, if there is one")


def _check_family(family: str, result: ProbeResult, usb: list[UsbCamera]) -> Iterator[Finding]:
    check = _NAMES[family]
    on_usb = ", ".join(f"{camera.product} on USB {camera.where}" for camera in usb)
    if result.problem is not None:
        yield note(check, result.problem + (f"; the kernel sees {on_usb}" if usb else ""))
    elif result.devices:
        yield ok(check, ", ".join(_describe(device) for device in result.devices))
        if len(usb) > len(result.devices):
            yield note(check, f"the kernel sees more of them: {on_usb}", _UDEV)
    elif usb:
        yield missing(check, f"the kernel sees {on_usb}, the vendor's library does not", _UDEV)
    else:
        yield note(check, "none", "connect them to USB 3 ports, with USB 3 cables")
    for device in result.devices:
        if device.get("usb", "3").startswith(("1", "2")):
            remedy = "use a USB 3 port and cable, without a hub; each camera on a controller of its own"
            yield note(check, f"{_describe(device)} is connected as USB {device['usb']}: no 60 frames a second", remedy)


def _describe(device: Mapping[str, str]) -> str:
    if "mxid" in device:
        return f"mxid {device['mxid']} ({device['state']})"
    firmware = f", firmware {device['firmware']}" if device["firmware"] else ""
    return f"{device['model']}, serial {device['serial']}{firmware}"


def check_without_station(present: Present) -> Iterator[Finding]:
    """Say whether a live run is possible at all."""
    remedy = "recordings can be replayed all the same; for a live run name a station file: ghest-rt doctor --station FILE"
    if not present.has_camera:
        yield missing("cameras for a live run", "no depth camera is connected", remedy, exit_code=3)
    if not present.ports and not present.can:
        yield missing("encoders for a live run", "no serial port and no CAN interface", remedy, exit_code=3)


def check_station_devices(station: LoadedStation, present: Present) -> Iterator[Finding]:
    """Say whether what the station file names is there."""
    folder = Path(station.source).parent
    for name, camera in station.config.cameras.items():
        device, check = camera.device, f"camera {name}"
        if isinstance(device, RealsenseBackend):
            yield _camera(check, f"RealSense {device.serial}", "serial", device.serial, present.cameras["realsense"])
        elif isinstance(device, OakBackend):
            yield _camera(check, f"OAK {device.mxid}", "mxid", device.mxid, present.cameras["oak"])
        elif isinstance(device, RealsenseBagBackend):
            yield _file(check, folder / device.path)
        else:
            yield ok(check, f"{device.backend}: needs no device")
    yield from _encoders(station, folder, present)


def _camera(check: str, what: str, key: str, wanted: str, result: ProbeResult) -> Finding:
    if any(device[key] == wanted for device in result.devices):
        return ok(check, f"{what} is connected")
    others = ", ".join(device[key] for device in result.devices) or "none"
    reason = f" ({result.problem})" if result.problem else ""
    remedy = f"connect it, or correct {key} in the station file; connected: {others}"
    return missing(check, f"{what} is not connected{reason}", remedy, exit_code=3)


def _file(check: str, path: Path) -> Finding:
    if path.is_file():
        return ok(check, f"{path} is there")
    return missing(check, f"there is no {path}", "correct the path in the station file", exit_code=3)


def _encoders(station: LoadedStation, folder: Path, present: Present) -> Iterator[Finding]:
    device = station.config.encoders.device
    if isinstance(device, SerialBackend):
        yield _port("encoders", device.port, present)
    elif isinstance(device, CanBackend | CanopenBackend):
        yield _bus("encoders", device.bus, present)
    elif isinstance(device, CanLogBackend | ArmeoBackend):
        yield _file("encoders", folder / device.path)
    else:
        yield ok("encoders", f"{device.backend}: needs no device")


def _port(check: str, port: str, present: Present) -> Finding:
    if "://" in port:
        return note(check, f"{port} is on the network: not looked at", "ghest-rt doctor --live opens it")
    if not Path(port).exists():
        others = ", ".join(found.path for found in present.ports) or "none"
        remedy = f"connect the encoder box, or correct encoders.device.port; ports found: {others}"
        return missing(check, f"there is no port {port}", remedy, exit_code=3)
    if not is_serial(Path(port)):
        others = ", ".join(found.path for found in present.ports) or "none"
        remedy = f"correct encoders.device.port; ports found: {others}"
        return missing(check, f"{port} is not a serial port", remedy, exit_code=3)
    if not may_open(Path(port)):
        return missing(check, f"{port} may not be opened by this user", _GROUP, exit_code=3)
    return ok(check, f"{port} is there")


def _bus(check: str, bus: CanBus, present: Present) -> Finding:
    if bus.interface == "slcan":
        return _port(check, bus.channel.partition("@")[0], present)
    if bus.interface != "socketcan":
        return note(check, f"CAN by {bus.interface}: not looked at", "ghest-rt doctor --live opens it")
    interface = next((found for found in present.can if found.name == bus.channel), None)
    if interface is None:
        others = ", ".join(found.name for found in present.can) or "none"
        remedy = f"connect the CAN adapter, or correct encoders.device.bus.channel; interfaces found: {others}"
        return missing(check, f"there is no CAN interface {bus.channel}", remedy, exit_code=3)
    if not interface.is_up:
        bitrate = bus.bitrate or "BITRATE"
        remedy = f"sudo ip link set {bus.channel} up type can bitrate {bitrate}"
        return missing(check, f"the CAN interface {bus.channel} is switched off", remedy, exit_code=3)
    return ok(check, f"{bus.channel} is up")
