"""Whether the devices that a station names are connected and can be used."""

import json
import os
import re
from pathlib import Path
from typing import Any

import pytest

from ghest_drivers.hardware.probe import ProbeResult
from ghest_rt.cli.doctor.devices import Present, check_present, check_station_devices, check_without_station
from ghest_rt.cli.doctor.findings import State
from ghest_rt.cli.doctor.links import CanInterface, SerialPort
from ghest_rt.cli.doctor.usb import UsbCamera
from tests.doctor.stations import NOTHING, SR300, station_of, with_device


def _states(findings: Any) -> dict[str, State]:
    return {finding.check: finding.state for finding in findings}


def test_without_a_station_nothing_connected_is_not_ready() -> None:
    assert [finding.exit_code for finding in check_without_station(NOTHING)] == [3, 3]
    present = Present({"realsense": ProbeResult((SR300,))}, [], [SerialPort("/dev/ttyUSB0", True)], [])
    assert list(check_without_station(present)) == []


def test_devices_of_the_station_are_recognised_by_serial_number(tmp_path: Path, station_text: str) -> None:
    master, slave = os.openpty()
    text = station_text.replace("000000000001", "123").replace("/dev/ttyNoSuchPort", os.ttyname(slave))
    present = Present({"realsense": ProbeResult((SR300,)), "oak": ProbeResult(())}, [], [], [])
    findings = list(check_station_devices(station_of(tmp_path, text), present))
    os.close(slave)
    os.close(master)
    assert _states(findings) == {"camera r0": State.MISSING, "camera r1": State.OK, "encoders": State.OK}
    assert "connected: 123" in findings[0].remedy


@pytest.mark.parametrize("port", ["/dev/null", "/dev", __file__])
def test_what_is_no_serial_port_is_told(tmp_path: Path, station_text: str, port: str) -> None:
    station = station_of(tmp_path, station_text.replace("/dev/ttyNoSuchPort", port))
    finding = list(check_station_devices(station, NOTHING))[-1]
    assert (finding.state, finding.exit_code) == (State.MISSING, 3)
    assert f"{port} is not a serial port" in finding.detail
    assert "encoders.device.port" in finding.remedy


@pytest.mark.parametrize(
    ("device", "can", "expected"),
    [
        ('{ interface = "socketcan", channel = "can7" }', [], (State.MISSING, "no CAN interface can7")),
        ('{ interface = "socketcan", channel = "can7" }', [CanInterface("can7", False)], (State.MISSING, "switched off")),
        ('{ interface = "socketcan", channel = "can7" }', [CanInterface("can7", True)], (State.OK, "can7 is up")),
        ('{ interface = "slcan", channel = "/dev/ttyNoPort@115200" }', [], (State.MISSING, "no port /dev/ttyNoPort")),
        ('{ interface = "pcan", channel = "PCAN_USBBUS1" }', [], (State.NOTE, "not looked at")),
    ],
)
def test_can_encoders(
    tmp_path: Path, station_text: str, device: str, can: list[CanInterface], expected: tuple[State, str]
) -> None:
    channels = ", ".join(f'{joint} = {{ source = "{k}" }}' for k, joint in enumerate(_joints(station_text)))
    table = f'{{ backend = "canopen", bus = {device}, channels = {{ {channels} }} }}'
    station = station_of(tmp_path, with_device(station_text, "encoders", table))
    finding = list(check_station_devices(station, Present(NOTHING.cameras, [], [], can)))[-1]
    assert finding.state is expected[0]
    assert expected[1] in finding.detail


def _joints(text: str) -> list[str]:
    match = re.search(r"^joints = (\[.*?\])", text, flags=re.MULTILINE)
    return json.loads(match[1]) if match else []


def test_files_in_place_of_devices_are_looked_for_beside_the_station_file(tmp_path: Path, station_text: str) -> None:
    text = with_device(station_text, "cameras.r0", '{ backend = "realsense_bag", path = "r0.bag" }')
    text = with_device(text, "cameras.r1", '{ backend = "realsense_bag", path = "r1.bag" }')
    station = station_of(tmp_path, text)
    (tmp_path / "r0.bag").write_bytes(b"")
    assert _states(list(check_station_devices(station, NOTHING))[:2]) == {"camera r0": State.OK, "camera r1": State.MISSING}


def test_a_camera_that_only_the_kernel_sees_is_a_matter_of_permissions() -> None:
    usb = [UsbCamera("realsense", "Intel RealSense 3D Camera SR300", "2-1", 5000.0)]
    finding = next(iter(check_present(Present(NOTHING.cameras, usb, [], []))))
    assert finding.state is State.MISSING
    assert "udev" in finding.remedy


def test_a_camera_on_usb_2_is_told() -> None:
    slow = {**SR300, "usb": "2.1"}
    findings = list(check_present(Present({"realsense": ProbeResult((slow,))}, [], [], [])))
    assert any("USB 2.1" in finding.detail for finding in findings)
