"""A station whose parts do not fit each other is refused before anything is started, whoever asks."""

import os
import shutil
from pathlib import Path

import pytest

from ghest_rt.cli.install_service.station_files import accept
from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.errors import BadInputError, DeviceError, GhestError, NotPermittedError
from ghest_rt.security.authority import Authority
from ghest_rt.security.roles import Role
from ghest_rt.service.station_check import check_station

_NOBODY = 65534
SIM = (shipped_config_dir() / "station-sim.toml").read_text()
SERIAL = (shipped_config_dir() / "station-sr300-serial.toml").read_text()
REAL = 'device = { backend = "serial", port = "/dev/ttyUSB0", baud = 115200 }'
JOINTS = ("j0", "j1", "j2", "j4", "j6", "j8", "j9")
SIGNALS = dict(
    zip(
        JOINTS,
        (
            *(f"Armeo_Shoulder.{name}Shoulder" for name in ("Inner", "Outer", "Upper")),
            *(f"Armeo_Elbow.{name}" for name in ("Elbow", "Forearm", "ProSupination")),
            "Armeo_Wrist.FlexionExtension",
        ),
        strict=True,
    )
)
SETTINGS = "settings_m = { j3_length = 0.145, j5 = 0.0, j7 = 0.0 }"


def channels(sources: dict[str, str], scale: str = ", deg_per_count = 1.0") -> str:
    return "channels = { " + ", ".join(f'{joint} = {{ source = "{name}"{scale} }}' for joint, name in sources.items()) + " }"


def can(sources: dict[str, str], dbc: str = "armeo_spring.dbc", scale: str = ", deg_per_count = 1.0") -> str:
    bus = 'bus = { interface = "virtual", channel = "x" }'
    return f'device = {{ backend = "can", dbc = "{dbc}", {bus}, {channels(sources, scale)} }}'


def export(path: str) -> str:
    return f'device = {{ backend = "armeo", path = "{path}", {channels({joint: joint.upper() for joint in JOINTS})} }}'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with what the stations name."""
    for name in ("armeo_spring.urdf", "armeo_spring.dbc"):
        shutil.copy(shipped_config_dir() / name, tmp_path)
    (tmp_path / "junk.dbc").write_text("VERSION oh dear")
    (tmp_path / "other.csv").write_text("Timestamp;A;B\n00:00:00.000;1;2\n")
    row = ";".join(["00:00:00.000", *"1234567"])
    (tmp_path / "good.csv").write_text("Timestamp;" + ";".join(joint.upper() for joint in JOINTS) + f"\n{row}\n")
    return tmp_path


def check(folder: Path, text: str) -> None:
    (folder / "station.toml").write_text(text)
    check_station(load_station(folder / "station.toml"))


@pytest.mark.parametrize(
    ("text", "old", "new", "says"),
    [
        (SIM, 'base_link = "l0"', 'base_link = "lx"', "exoskeleton.base_link = 'lx' is not a link of armeo_spring.urdf"),
        (SIM, 'link = "l8"', 'link = "l99"', "cameras.r1.link = 'l99'"),
        (SIM, "j3_length = 0.145", "j3_len = 0.145", "; did you mean j3_length?"),
        (SIM, SETTINGS, "settings_m = {}", "set its length in exoskeleton.settings_m.j3_length"),
        (SIM, "j3_length = 0.145", "j3_length = 5.0", "outside the limits"),
        (SIM, '"j1", "j2"', '"j1"', "add it to encoders.joints"),
        (SIM, '"j1", "j2"', '"j0", "j2"', "twice"),
        (SERIAL, REAL, 'device = { backend = "sim" }', "cameras.r0 is realsense"),
        (SERIAL, REAL, can(SIGNALS, dbc="none.dbc"), "cannot read the DBC file"),
        (SERIAL, REAL, can(SIGNALS, dbc="junk.dbc"), "the DBC file is not valid"),
        (SERIAL, REAL, can({**SIGNALS, "j0": "Nothing.There"}), "'Nothing.There': not in the DBC file"),
        (SERIAL, REAL, can(SIGNALS, scale=""), "deg_per_count or counts_per_turn must be given"),
        (SERIAL, REAL, can({"j0": SIGNALS["j0"]}), "channels.j1.source: must be given"),
        (SERIAL, REAL, export("other.csv"), "no column 'J0'"),
        (SERIAL, REAL, export("none.csv"), "there is no such file"),
        (SIM, "[elbow]", '[publisher]\nidentity = "none"\n[elbow]', "no identity here"),
        (SIM, "[elbow]", '[publisher]\nlisten = ["tls/0.0.0.0:7446"]\n[elbow]', "TLS needs an identity"),
        (SIM, "[elbow]", '[publisher]\nlisten = ["7446"]\n[elbow]', "is not a Zenoh endpoint"),
        (SIM, "[elbow]", '[recorder]\nencrypt_to = ["age1xyz"]\n[elbow]', "recorder.encrypt_to: 'age1xyz': not a public key"),
        (SERIAL.replace('method = "fused"', 'method = "paper"'), 'marker = "m1"', 'marker = "m1"\ndepth = false', "cameras.r1"),
    ],
)
def test_what_the_service_would_refuse_is_told_with_the_file(folder: Path, text: str, old: str, new: str, says: str) -> None:
    check(folder, text)
    assert old in text
    with pytest.raises(GhestError) as caught:
        check(folder, text.replace(old, new, 1))
    assert says in str(caught.value)
    assert str(folder / "station.toml") in str(caught.value) or str(folder / "none.dbc") in str(caught.value)
    assert isinstance(caught.value, DeviceError if "none.csv" in new else BadInputError)


@pytest.mark.parametrize("device", [can(SIGNALS), export("good.csv")])
def test_encoders_by_file_that_fit_are_accepted(folder: Path, device: str) -> None:
    check(folder, SERIAL.replace(REAL, device))


def test_every_shipped_station_passes(tmp_path: Path) -> None:
    config = tmp_path / "config"
    shutil.copytree(shipped_config_dir(), config)
    identity = Authority.create(tmp_path / "pki", "Clinic A", 30).issue(Role.STATION, "bed-1", ["127.0.0.1"], 10)
    shutil.copytree(identity, config / "examples" / "networked" / "station.bed-1")
    paths = sorted(config.rglob("*.toml"))
    assert len(paths) > 5
    for path in paths:
        check_station(load_station(path))


def test_an_identity_that_this_user_may_not_look_at_is_no_mistake_of_the_station(tmp_path: Path) -> None:
    identity = Authority.create(tmp_path / "pki", "Clinic A", 30).issue(Role.STATION, "bed-1", ["127.0.0.1"], 10)
    told = f'[publisher]\nlisten = ["tls/0.0.0.0:7446"]\nidentity = "{identity}"\n[elbow]'
    path = tmp_path / "station.toml"
    path.write_text(SIM.replace("[elbow]", told), encoding="utf-8")
    shutil.copy(shipped_config_dir() / "armeo_spring.urdf", tmp_path)
    station = load_station(path)
    check_station(station)
    identity.chmod(0)
    user = os.geteuid()
    if user == 0:
        os.seteuid(_NOBODY)
    try:
        with pytest.raises(NotPermittedError, match=f"{identity}: cannot look for an identity here"):
            check_station(station)
        accept(station, here=True)
    finally:
        os.seteuid(user)
    identity.chmod(0o700)


def test_elsewhere_the_identity_and_the_files_of_this_machine_are_not_looked_at(folder: Path) -> None:
    text = SIM.replace("[elbow]", '[publisher]\nlisten = ["tls/0.0.0.0:7446"]\nidentity = "/etc/none"\n[elbow]')
    (folder / "station.toml").write_text(text)
    station = load_station(folder / "station.toml")
    check_station(station, here=False)
    check_station(station, publish=False)
    with pytest.raises(BadInputError, match="no identity here"):
        check_station(station)
