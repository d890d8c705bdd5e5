"""A station file that is wrong is refused with file, key path and remedy."""

from pathlib import Path

import pytest

from ghest_rt.config.load import load_station, parse_station
from ghest_rt.errors import BadInputError

IDENTITY = "[[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]"
MARKER = """half_spacing_m = 0.018
disk_radius_m = 0.008
plate_m = 0.06
disk_rgb = [[214, 40, 57], [124, 181, 24], [0, 158, 165], [122, 62, 180]]
"""
GOOD = f"""
format = 1
[station]
id = "test"
arm = "right"
[exoskeleton]
urdf = "exo.urdf"
[markers.m0]
{MARKER}
[markers.m1]
{MARKER}
[cameras.r0]
link = "l0"
marker = "m0"
device = {{ backend = "sim" }}
[cameras.r1]
link = "l8"
marker = "m1"
device = {{ backend = "sim" }}
[encoders]
joints = ["j0", "j1"]
device = {{ backend = "sim" }}
[calibration]
id = "cal-1"
m0_from_gh = {IDENTITY}
m1_from_elw = {IDENTITY}
[calibration.link_from_camera]
r0 = {IDENTITY}
r1 = {IDENTITY}
"""


def test_a_good_file_loads_with_its_urdf(tmp_path: Path) -> None:
    (tmp_path / "exo.urdf").write_text("<robot name='x'/>")
    (tmp_path / "station.toml").write_text(GOOD)
    station = load_station(tmp_path / "station.toml")
    assert station.config.station.id == "test"
    assert station.config.estimator.method == "fused"
    assert station.urdf_text == "<robot name='x'/>"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('arm = "right"', 'arm = "right"\nmode = 1', ("station.mode", "remove it")),
        ('arm = "right"', "", ("station.arm", "add this key")),
        ('arm = "right"', 'am = "right"', ("station.am: is not known here; did you mean arm?",)),
        ("[calibration]", "[estimator]\nlag_msec = 1.0\n[calibration]", ("estimator.lag_msec", "did you mean lag_ms?")),
        ("[calibration]", "[estimator]\nmax_gap_ms = 1e6\n[calibration]", ("estimator.max_gap_ms", "at most 1000")),
        ("[calibration]", "[estimator]\nsigma_limit_deg = 1e6\n[calibration]", ("sigma_limit_deg", "at most 180")),
        ("format = 1", 'format = 1\nrate_hz = "66"', ("rate_hz: must be a number, not", "without quotes")),
        ("format = 1", "format = 1\nrate_hz = nan", ("rate_hz: must be a finite number",)),
        ("format = 1", "format = 1\nrate_hz = 0.5", ("rate_hz: must be at least 1, is 0.5",)),
        ('id = "test"', 'id = "a b"', ("station.id", "letters, digits, - and _")),
        ('id = "test"', "id = 1979-05-27", ("station.id: must be text in quotes",)),
        ("[cameras.r0]", '[cameras."r 0"]', ('cameras."r 0"', "letters, digits")),
        ('backend = "sim"', 'backend = "simm"', ("cameras.r0.device.backend", "did you mean sim?")),
        ('backend = "sim"', "width_px = 3", ("cameras.r0.device.backend: is missing",)),
        ('backend = "sim"', 'backend = "sim", sensor = "x"', ("cameras.r0.device.sensor: must be 'paper' or 'sr300'",)),
        ('joints = ["j0", "j1"]', "joints = []", ("encoders.joints: must not be empty",)),
        ("[214, 40, 57]", "[214, 40, 300]", ("markers.m0.disk_rgb[0][2]: must be at most 255",)),
        ("[214, 40, 57]", "[214, 40]", ("markers.m0.disk_rgb[0][2]: is missing",)),
        ('arm = "right"', 'arm = "middle"', ("station.arm", "'right' or 'left'")),
        ("half_spacing_m = 0.018", "half_spacing_m = 18.0", ("markers.m0.half_spacing_m", "less than 0.2", "millimetres?")),
        ("plate_m = 0.06", "plate_m = 0.04", ("markers.m0", "too small")),
        ("[1.0, 0.0, 0.0, 0.0]", "[1.0, 0.0, 0.0, -55.0]", ("calibration.m0_from_gh", "55 m long", "0.5 m", "millimetres?")),
        ("r1 = [[1.0, 0.0, 0.0, 0.0]", "r1 = [[1.0, 0.0, 0.0, -434]", ("calibration.link_from_camera.r1", "434", "in metres")),
        ("[214, 40, 57], [124, 181, 24]", "[214, 40, 57], [214, 40, 57]", ("markers.m0", "p0", "p1", "too much alike")),
        ("[214, 40, 57], [124, 181, 24]", "[214, 40, 57], [107, 20, 28]", ("markers.m0", "too much alike", "however bright")),
        ('joints = ["j0", "j1"]', 'joints = ["j0", "j1", "j0"]', ("encoders", "joints names j0 twice")),
        ("r0 = [[1.0, 0.0", "r0 = [[2.0, 0.0", ("calibration.link_from_camera.r0", "not rigid")),
        ("r1 = [[1.0", "r2 = [[1.0", ("calibration.link_from_camera", "lacks r1")),
        ('marker = "m1"', 'marker = "m0"', ("cameras.r1.marker must be m1",)),
        ("format = 1", "format = 2", ("format",)),
        ("[encoders]", '[elbow]\nlink = "l8"\naxis = [0.0, 2.0, 0.0]\n[encoders]', ("elbow", "length 1")),
        (
            "[encoders]",
            '[elbow]\nlink = "l8"\naxis = [0.0, 1.0, 0.0]\npronation_joint = "j8"\n[encoders]',
            ("elbow.pronation_joint j8", "encoders.joints"),
        ),
        ('arm = "right"', 'arm = "right"\n[joint]\nflexion_sign = 2', ("joint.flexion_sign",)),
        ("format = 1", "format = = 1", ("not a valid TOML file", "line 2")),
    ],
)
def test_each_mistake_is_named(old: str, new: str, words: tuple[str, ...]) -> None:
    assert old in GOOD
    with pytest.raises(BadInputError) as caught:
        parse_station(GOOD.replace(old, new, 1), "clinic.toml")
    assert str(caught.value).startswith("clinic.toml: ")
    for word in words:
        assert word in str(caught.value)


def test_missing_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="station file"):
        load_station(tmp_path / "absent.toml")
    (tmp_path / "station.toml").write_text(GOOD)
    with pytest.raises(BadInputError, match=r"exo\.urdf"):
        load_station(tmp_path / "station.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(BadInputError, match="UTF-8"):
        load_station(tmp_path / "binary.toml")


@pytest.mark.parametrize(
    ("device", "says"),
    [
        ('{ backend = "realsense", serial = "123" }', "the same device, serial 123"),
        ('{ backend = "oak", mxid = "18" }', "the same device, mxid 18"),
        ('{ backend = "realsense_bag", path = "a.bag" }', "the same device, path a.bag"),
    ],
)
def test_one_device_cannot_be_both_cameras(device: str, says: str) -> None:
    with pytest.raises(BadInputError, match=says):
        parse_station(GOOD.replace('device = { backend = "sim" }', f"device = {device}", 2), "clinic.toml")


SERIAL = 'joints = ["j0", "j1"]\ndevice = { backend = "serial", port = "/dev/x", %s }'


@pytest.mark.parametrize(
    ("device", "lines"),
    [
        ('layout = { kind = "binary", fields = ["a0:i12"] }', ["encoders.device.layout.fields[0]: must read name:type"]),
        (
            'layout = { kind = "binary", fields = [], sync_hex = "z" }',
            ["encoders.device.layout.sync_hex: must be 1 to 8 bytes", "encoders.device.layout.fields: must not be empty"],
        ),
        ("channels = { j0 = { sgn = 1 } }", ["encoders.device.channels.j0.sgn: is not known here; did you mean sign?"]),
        ("baud = 1.5, bauds = 1", ["encoders.device.bauds: is not known", "encoders.device.baud: must be a whole number"]),
    ],
)
def test_each_mistake_is_one_line_with_the_key_as_it_stands_in_the_file(device: str, lines: list[str]) -> None:
    text = GOOD.replace('joints = ["j0", "j1"]\ndevice = { backend = "sim" }', SERIAL % device)
    with pytest.raises(BadInputError) as caught:
        parse_station(text, "clinic.toml")
    told = str(caught.value).splitlines()[1:]
    assert len(told) == len(lines)
    for line, begins in zip(told, lines, strict=True):
        assert line.startswith(f"  {begins}")


def test_a_table_with_a_wrong_name_is_not_said_to_be_missing_besides() -> None:
    with pytest.raises(BadInputError) as caught:
        parse_station(GOOD.replace("[station]", "[statoin]"), "clinic.toml")
    assert str(caught.value).splitlines()[1:] == ["  statoin: is not known here; did you mean station?"]
