"""What `ghest-rt doctor` finds, says and ends with."""

import json
import re
import socket
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ghest_drivers.clock import VirtualClock
from ghest_drivers.errors import BadDeviceData, DeviceNotFound, ReadTimeout
from ghest_drivers.hardware.probe import ProbeResult, probe
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, Intrinsics, RgbdFrame
from ghest_rt.cli.doctor import command
from ghest_rt.cli.doctor.checklist import CHECKLIST
from ghest_rt.cli.doctor.devices import Present, check_present, check_station_devices, check_without_station
from ghest_rt.cli.doctor.findings import Finding, State, exit_code, missing, note, ok
from ghest_rt.cli.doctor.links import CanInterface, SerialPort, can_interfaces, serial_ports
from ghest_rt.cli.doctor.live import check_cameras, check_encoders
from ghest_rt.cli.doctor.machine import check_endpoints, check_extras
from ghest_rt.cli.doctor.usb import UsbCamera, usb_cameras
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.shipped import shipped_config_dir

_ROOT = Path(__file__).parents[2]
_NOTHING = Present({"realsense": ProbeResult(()), "oak": ProbeResult(())}, [], [], [])
_SR300 = {"model": "Intel RealSense SR300", "serial": "123", "firmware": "3.26.1.0", "usb": "3.0"}


def doctor(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ghest_rt.cli.main", "doctor", *arguments], capture_output=True, text=True, check=False
    )


@pytest.fixture
def station_text() -> str:
    """The shipped SR300 station, with a port that no machine has."""
    text = (shipped_config_dir() / "station-sr300-serial.toml").read_text()
    return text.replace("/dev/ttyUSB0", "/dev/ttyNoSuchPort")


def station_of(tmp_path: Path, text: str) -> LoadedStation:
    urdf = (shipped_config_dir() / "armeo_spring.urdf").read_text()
    (tmp_path / "armeo_spring.urdf").write_text(urdf)
    path = tmp_path / "station.toml"
    path.write_text(text)
    return load_station(path)


def with_device(text: str, table: str, device: str) -> str:
    """Replace the device line of a table."""
    return re.sub(rf"(\[{re.escape(table)}\].*?\ndevice = )[^\n]*", lambda match: match[1] + device, text, flags=re.DOTALL)


def test_a_station_without_its_devices_ends_with_3_and_says_what_to_do(tmp_path: Path, station_text: str) -> None:
    station_of(tmp_path, station_text)
    done = doctor("--station", str(tmp_path / "station.toml"), "--json")
    assert done.returncode == 3
    assert "Traceback" not in done.stderr
    answer = json.loads(done.stdout)
    needed = {finding["check"]: finding for finding in answer["findings"] if finding["exit_code"] == 3}
    assert {"camera r0", "camera r1", "encoders"} <= set(needed)
    assert all(finding["remedy"] for finding in needed.values())
    assert {item["id"] for item in answer["checklist"]} >= {"usb", "latency"}


def test_it_prints_for_people_too(tmp_path: Path, station_text: str) -> None:
    station_of(tmp_path, station_text)
    done = doctor("--station", str(tmp_path / "station.toml"))
    assert done.returncode == 3
    assert "Not ready: " in done.stdout
    assert "Traceback" not in done.stdout + done.stderr


def test_a_bad_station_file_ends_with_2_and_the_rest_is_looked_at(tmp_path: Path) -> None:
    path = tmp_path / "station.toml"
    path.write_text("format = 1\nspeed = 3\n")
    done = doctor("--station", str(path), "--json")
    assert done.returncode == 2
    findings = json.loads(done.stdout)["findings"]
    assert "speed" in next(finding for finding in findings if finding["check"] == "station file")["detail"]
    assert any(finding["check"] == "real-time priority" for finding in findings)


def test_live_needs_a_station() -> None:
    done = doctor("--live", "1")
    assert done.returncode == 2
    assert "--station" in done.stderr


def test_without_a_station_nothing_connected_is_not_ready() -> None:
    assert [finding.exit_code for finding in check_without_station(_NOTHING)] == [3, 3]
    present = Present({"realsense": ProbeResult((_SR300,))}, [], [SerialPort("/dev/ttyUSB0", True)], [])
    assert list(check_without_station(present)) == []


def _states(findings: Any) -> dict[str, State]:
    return {finding.check: finding.state for finding in findings}


def test_devices_of_the_station_are_recognised_by_serial_number(tmp_path: Path, station_text: str) -> None:
    station = station_of(tmp_path, station_text.replace("000000000001", "123").replace("/dev/ttyNoSuchPort", "/dev/null"))
    present = Present({"realsense": ProbeResult((_SR300,)), "oak": ProbeResult(())}, [], [], [])
    findings = list(check_station_devices(station, present))
    assert _states(findings) == {"camera r0": State.MISSING, "camera r1": State.OK, "encoders": State.OK}
    assert "connected: 123" in findings[0].remedy


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
    finding = list(check_station_devices(station, Present(_NOTHING.cameras, [], [], can)))[-1]
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
    assert _states(list(check_station_devices(station, _NOTHING))[:2]) == {"camera r0": State.OK, "camera r1": State.MISSING}


def test_a_camera_that_only_the_kernel_sees_is_a_matter_of_permissions() -> None:
    usb = [UsbCamera("realsense", "Intel RealSense 3D Camera SR300", "2-1", 5000.0)]
    finding = next(iter(check_present(Present(_NOTHING.cameras, usb, [], []))))
    assert finding.state is State.MISSING
    assert "udev" in finding.remedy


def test_a_camera_on_usb_2_is_told() -> None:
    slow = {**_SR300, "usb": "2.1"}
    findings = list(check_present(Present({"realsense": ProbeResult((slow,))}, [], [], [])))
    assert any("USB 2.1" in finding.detail for finding in findings)


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


def test_a_taken_port_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        (taken,) = check_endpoints([endpoint])
    assert (taken.state, taken.exit_code) == (State.MISSING, 1)
    assert "--listen" in taken.remedy
    (free,) = check_endpoints([endpoint])
    assert free.state is State.OK


def test_an_extra_that_the_station_needs_is_missing_and_another_is_only_noted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    findings = {finding.check: finding for finding in check_extras({"oak"})}
    assert (findings["extra oak"].state, findings["extra oak"].exit_code) == (State.MISSING, 3)
    assert "ghest-rt[oak]" in findings["extra oak"].remedy
    assert (findings["extra can"].state, findings["extra can"].exit_code) == (State.NOTE, 0)


@pytest.mark.parametrize(("codes", "expected"), [([], 0), ([0, 0], 0), ([1, 3, 0], 3), ([3, 2, 1], 2), ([0, 1], 1)])
def test_the_gravest_finding_sets_the_exit_code(codes: list[int], expected: int) -> None:
    assert exit_code([missing("x", "y", "z", code) for code in codes]) == expected
    assert exit_code([ok("x", "y"), note("x", "y")]) == 0


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


_CAMERA = CameraInfo("r0", "m", "s", Intrinsics(8, 8, 9, 9, 4, 4), Intrinsics(8, 8, 9, 9, 4, 4), 0.001, np.eye(4), 50.0)


class FakeCamera:
    """Delivers frames on a virtual clock."""

    def __init__(self, clock: VirtualClock, *, period_ns: int = 20_000_000, depth: int = 500, step: int = 1, error: Any = None):
        self.clock, self.period_ns, self.depth, self.step, self.error = clock, period_ns, depth, step, error
        self.info = _CAMERA
        self.k = 0

    def open(self) -> None:
        if isinstance(self.error, DeviceNotFound):
            raise self.error

    def read(self, timeout_s: float) -> RgbdFrame:
        self.clock.sleep_until_ns(self.clock.now_ns() + self.period_ns)
        self.k += 1
        if self.error is not None and self.k % 3 == 0:
            raise self.error
        t_ns = self.clock.now_ns()
        depth = np.full((8, 8), self.depth, np.uint16)
        return RgbdFrame(_CAMERA, self.k * self.step, np.zeros((8, 8, 3), np.uint8), depth, 0, t_ns, t_ns - 5_000_000, t_ns)

    def close(self) -> None:
        """Nothing to close."""


def _live(**camera: Any) -> list[Finding]:
    clock = VirtualClock(10**9)
    return list(check_cameras({"r0": FakeCamera(clock, **camera)}, 2.0, clock))


def test_a_good_camera_passes_with_its_figures() -> None:
    (finding,) = _live()
    assert finding.state is State.OK
    assert "100 frames, 50.00 Hz, 0.0% missing, depth in 100% of the middle, 5.0 ms old" in finding.detail


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        ({"period_ns": 40_000_000}, "too slow for 50 Hz"),
        ({"step": 2}, "frames are lost"),
        ({"depth": 0}, "hardly any depth"),
        ({"error": BadDeviceData("garbled")}, "33 unusable frames"),
    ],
)
def test_a_camera_that_is_not_good_enough_is_told_why(camera: dict[str, Any], words: str) -> None:
    (finding,) = _live(**camera)
    assert finding.state is State.NOTE
    assert words in finding.remedy


@pytest.mark.parametrize("error", [DeviceNotFound("not there"), ReadTimeout("silent")])
def test_a_camera_without_frames_is_missing(error: Exception) -> None:
    clock = VirtualClock(10**9)
    camera = FakeCamera(clock, error=error)
    camera.k = 2

    def silent(timeout_s: float) -> RgbdFrame:
        clock.sleep_until_ns(clock.now_ns() + round(timeout_s * 1e9))
        raise error

    camera.read = silent  # type: ignore[method-assign]
    (finding,) = check_cameras({"r0": camera}, 2.0, clock)
    assert (finding.state, finding.exit_code) == (State.MISSING, 3)


def test_cameras_that_blind_each_other_are_told() -> None:
    clock = VirtualClock(10**9)
    cameras = {name: FakeCamera(clock) for name in ("r0", "r1")}
    opened: set[str] = set()

    def blinding(name: str, read: Any) -> Any:
        def wrapped(timeout_s: float) -> RgbdFrame:
            opened.add(name)
            frame = read(timeout_s)
            if cameras[name].k > 100:  # the second time, together
                frame.depth_counts[:, :4] = 0
            return frame

        return wrapped

    for name, camera in cameras.items():
        camera.read = blinding(name, camera.read)  # type: ignore[method-assign]
    findings = list(check_cameras(dict(cameras), 2.0, clock))
    assert any("projectors disturb each other" in finding.remedy for finding in findings)


class FakeEncoders:
    """Delivers samples on a virtual clock."""

    info = EncoderInfo("encoders", ("j0",))

    def __init__(self, clock: VirtualClock, period_ns: int) -> None:
        self.clock, self.period_ns, self.k = clock, period_ns, 0

    async def open(self) -> None:
        """Nothing to open."""

    async def read(self, timeout_s: float) -> EncoderSample:
        self.clock.sleep_until_ns(self.clock.now_ns() + self.period_ns)
        self.k += 1
        t_ns = self.clock.now_ns()
        return EncoderSample(self.k, np.array([np.pi / 2]), t_ns, t_ns, t_ns)

    async def close(self) -> None:
        """Nothing to close."""


@pytest.mark.parametrize(("period_ns", "state"), [(15_000_000, State.OK), (50_000_000, State.NOTE)])
def test_encoders_are_measured(period_ns: int, state: State) -> None:
    clock = VirtualClock(10**9)
    finding = check_encoders(FakeEncoders(clock, period_ns), 2.0, clock)
    assert finding.state is state
    assert "last angles 90.0 deg" in finding.detail


def test_the_checklist_is_explained_in_the_documentation() -> None:
    text = (_ROOT / "docs" / "hardware.md").read_text()
    for item in CHECKLIST:
        assert f"**{item.id}**" in text, item.id


def test_ready_is_said_when_all_is_there(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    present = Present({"realsense": ProbeResult((_SR300,)), "oak": ProbeResult(())}, [], [SerialPort("/dev/ttyUSB0", True)], [])
    monkeypatch.setattr(command, "_present", lambda: present)
    monkeypatch.setattr(command, "Publisher", lambda: SimpleNamespace(enabled=False, listen=()))
    assert command.run_doctor(None, None, as_json=False) == 0
    assert "Ready." in capsys.readouterr().out
