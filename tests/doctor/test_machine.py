"""What is found on the machine: USB cameras, ports, interfaces, vendor libraries, extras, taken network ports."""

import socket
from pathlib import Path

import pytest

from ghest_drivers.hardware.probe import probe
from ghest_rt.cli.doctor.findings import State
from ghest_rt.cli.doctor.links import CanInterface, can_interfaces, serial_ports
from ghest_rt.cli.doctor.machine import check_endpoints, check_extras
from ghest_rt.cli.doctor.usb import usb_cameras


def test_usb_cameras_are_found_in_sysfs(tmp_path: Path) -> None:
    for name, vendor, product, speed in (
        ("2-1", "8086", "0aa5", "5000"),
        ("1-4", "03e7", "2485", "480"),
        ("1-5", "8086", "9a13", "480"),  # a hub of the same vendor
        ("1-6", "046d", "c52b", "12"),
    ):
        folder = tmp_path / name
        folder.mkdir()
        for key, value in (("idVendor", vendor), ("idProduct", product), ("speed", speed)):
            (folder / key).write_text(value + "\n")
    found = usb_cameras(tmp_path)
    assert [(camera.family, camera.where, camera.is_slow) for camera in found] == [
        ("oak", "1-4", True),
        ("realsense", "2-1", False),
    ]


def test_ports_and_interfaces_are_found(tmp_path: Path) -> None:
    dev, net = tmp_path / "dev", tmp_path / "net"
    (dev / "serial/by-id").mkdir(parents=True)
    for name in ("serial/by-id/usb-FTDI-if00", "ttyUSB0", "ttyS0"):
        (dev / name).touch()
    for name, kind, flags in (("can0", "280", "0x1"), ("can1", "280", "0x0"), ("eth0", "1", "0x1")):
        (net / name).mkdir(parents=True)
        (net / name / "type").write_text(kind + "\n")
        (net / name / "flags").write_text(flags + "\n")
    assert [Path(port.path).name for port in serial_ports(dev)] == ["usb-FTDI-if00", "ttyUSB0"]
    assert list(can_interfaces(net)) == [CanInterface("can0", True), CanInterface("can1", False)]


@pytest.mark.parametrize(
    ("library", "problem"),
    [
        ("import time; time.sleep(60)", "did not answer"),
        ("import os; os.abort()", "ended the process"),
        ("print('noise')", None),
    ],
)
def test_a_vendor_library_may_hang_crash_or_chatter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, library: str, problem: str | None
) -> None:
    (tmp_path / "pyrealsense2.py").write_text(
        library + "\nfrom types import SimpleNamespace\n"
        "context = lambda: SimpleNamespace(query_devices=lambda: [])\ndistortion = frame_metadata_value = option = None\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    result = probe("realsense", timeout_s=3.0)
    assert result.devices == ()
    assert (result.problem is None) if problem is None else (problem in (result.problem or ""))


def test_an_extra_that_the_station_needs_is_missing_and_another_is_only_noted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    findings = {finding.check: finding for finding in check_extras({"oak"})}
    assert (findings["extra oak"].state, findings["extra oak"].exit_code) == (State.MISSING, 3)
    assert "[oak]" in findings["extra oak"].remedy
    assert (findings["extra can"].state, findings["extra can"].exit_code) == (State.NOTE, 0)


def test_a_taken_port_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        (taken,) = check_endpoints([endpoint])
    assert (taken.state, taken.exit_code) == (State.MISSING, 1)
    assert "--listen" in taken.remedy
    (free,) = check_endpoints([endpoint])
    assert free.state is State.OK
