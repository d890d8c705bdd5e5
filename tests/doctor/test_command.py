"""What `ghest-rt doctor` says, and ends with."""

import json
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest

from ghest_drivers.hardware.probe import ProbeResult
from ghest_rt.cli.doctor import command, station_file
from ghest_rt.cli.doctor.checklist import CHECKLIST
from ghest_rt.cli.doctor.findings import Finding, State, exit_code, missing, note, ok
from ghest_rt.cli.doctor.links import SerialPort
from ghest_rt.cli.doctor.station_file import look_at_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.errors import NotPermittedError
from tests.doctor.stations import SR300, station_of
from tests.program import COMMAND

_ROOT = Path(__file__).parents[2]


def doctor(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*COMMAND, "doctor", *arguments], capture_output=True, text=True, check=False)


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


@pytest.mark.parametrize(
    ("old", "new"),
    [('link = "l8"', 'link = "l99"'), ('"j1", "j2"', '"j1"'), ("[elbow]", '[publisher]\nidentity = "x"\n[elbow]')],
)
def test_a_station_that_the_service_would_refuse_is_not_ready(tmp_path: Path, station_text: str, old: str, new: str) -> None:
    station_of(tmp_path, station_text.replace(old, new, 1))
    done = doctor("--station", str(tmp_path / "station.toml"), "--json")
    assert done.returncode == 2
    finding = next(one for one in json.loads(done.stdout)["findings"] if one["check"] == "station file's parts")
    assert finding["exit_code"] == 2
    assert str(tmp_path / "station.toml") in finding["detail"]


def test_what_this_user_may_not_look_at_is_noted(tmp_path: Path, station_text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: object) -> None:
        raise NotPermittedError("/etc/ghest-rt/identity: cannot look for an identity here: Permission denied")

    monkeypatch.setattr(station_file, "check_station", refuse)
    station_of(tmp_path, station_text)
    _, findings = station_file.look_at_station(tmp_path / "station.toml")
    found = next(one for one in findings if one.check == "station file's parts")
    assert (found.state, found.exit_code) == (State.NOTE, 0)
    assert "service's user" in found.remedy


@pytest.mark.parametrize(
    ("arm", "name", "text"),
    [
        ("right", "a.urdf", "Armeo Spring, right arm."),
        ("left", "armeo_left.urdf", "It mirrors that of the right arm."),
        ("left", "a.urdf", "As for the right arm, mirrored for the left arm."),
        ("left", "a.urdf", "y to the patient's right"),
        ("left", "a.urdf", ""),
    ],
)
def test_an_arm_that_the_urdf_does_not_contradict_is_not_mentioned(
    tmp_path: Path, station_text: str, arm: str, name: str, text: str
) -> None:
    assert arm_notes(tmp_path, station_text.replace('arm = "right"', f'arm = "{arm}"'), name, text) == []


@pytest.mark.parametrize(
    ("arm", "name", "text"), [("left", "a.urdf", "Armeo Spring, right arm."), ("right", "armeo_left.urdf", "")]
)
def test_an_arm_that_the_urdf_contradicts_is_noted(tmp_path: Path, station_text: str, arm: str, name: str, text: str) -> None:
    (finding,) = arm_notes(tmp_path, station_text.replace('arm = "right"', f'arm = "{arm}"'), name, text)
    assert finding.state is State.NOTE
    assert "station.arm" in finding.remedy


def arm_notes(folder: Path, station_text: str, name: str, text: str) -> list[Finding]:
    """Return what is said of the arm when the URDF has this name and begins with this text."""
    urdf = (shipped_config_dir() / "armeo_spring.urdf").read_text().replace("Armeo Spring, right arm.", text)
    (folder / name).write_text(urdf)
    (folder / "station.toml").write_text(station_text.replace("armeo_spring.urdf", name))
    return [finding for finding in look_at_station(folder / "station.toml")[1] if finding.check == "arm"]


def test_the_shipped_stations_and_their_urdfs_agree_on_the_arm() -> None:
    for path in shipped_config_dir().glob("*.toml"):
        assert {finding.state for finding in look_at_station(path)[1]} == {State.OK}


def test_live_needs_a_station() -> None:
    done = doctor("--live", "1")
    assert done.returncode == 2
    assert "--station" in done.stderr


def test_ready_is_said_when_all_is_there(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(command, "probe", lambda family: ProbeResult((SR300,) if family == "realsense" else ()))
    monkeypatch.setattr(command, "usb_cameras", list)
    monkeypatch.setattr(command, "serial_ports", lambda: [SerialPort("/dev/ttyUSB0", True)])
    monkeypatch.setattr(command, "can_interfaces", list)
    monkeypatch.setattr(command, "Publisher", lambda: SimpleNamespace(enabled=False, listen=()))
    assert command.run_doctor(None, None, as_json=False) == 0
    assert "Ready." in capsys.readouterr().out


@pytest.mark.parametrize(("codes", "expected"), [([], 0), ([0, 0], 0), ([1, 3, 0], 3), ([3, 2, 1], 2), ([0, 1], 1)])
def test_the_gravest_finding_sets_the_exit_code(codes: list[int], expected: int) -> None:
    assert exit_code([missing("x", "y", "z", code) for code in codes]) == expected
    assert exit_code([ok("x", "y"), note("x", "y")]) == 0


def test_the_checklist_is_explained_in_the_documentation() -> None:
    text = (_ROOT / "docs" / "hardware.md").read_text()
    for item in CHECKLIST:
        assert f"**{item.id}**" in text, item.id
