"""Station files, URDFs and recordings made to harm: refused in time, with bounded memory; nothing they name is read."""

import os
import time
import tracemalloc
from pathlib import Path

import pytest
from mcap.data_stream import RecordBuilder
from mcap.records import Attachment, Channel, Metadata

from ghest_rt.config.load import load_station, parse_station
from ghest_rt.errors import BadInputError
from ghest_rt.kinematics.urdf import parse_urdf
from ghest_rt.recording.reader import Recording
from ghest_rt.recording.scan import scan_file
from tests.recording.conftest import STATION_TOML
from tests.recording.outsider import Outsider

_PROCESSOR_S = 3.0  # all of these took minutes, or the interpreter's stack, before they were limited


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a = " + "[" * 100_000, "nested too deeply"),
        ("a = " + "{a = " * 50_000, "nested too deeply"),
        ("a." * 100_000 + "b = 1", "line 1 has more than 200 dots"),
        ("[" + "a." * 100_000 + "b]", "line 1 has more than 200 dots"),
        ("x = " + "9" * 100_000, "not a valid TOML file"),
        ("x = 1\n" * 2, "not a valid TOML file"),
        ("\n".join(f"a{k} = 1" for k in range(20_000)), "remove it or correct its spelling"),
    ],
    ids=["arrays", "tables", "dotted key", "dotted header", "digits", "twice", "keys"],
)
def test_a_station_file_made_to_harm(text: str, says: str) -> None:
    start_s = time.process_time()
    with pytest.raises(BadInputError, match=says):
        parse_station(text, "x.toml")
    assert time.process_time() - start_s < _PROCESSOR_S


@pytest.mark.parametrize(
    "text",
    [
        "<robot>" + "<a>" * 300_000,
        "<robot>" + '<link name="a"/>' * 60_000,
        '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]><robot>&b;</robot>',
        '<!DOCTYPE r [<!ENTITY % x SYSTEM "file:///etc/passwd"> %x;]><robot/>',
        '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot><link name="&x;"/></robot>',
        '<robot xmlns:xi="http://www.w3.org/2001/XInclude"><xi:include href="/etc/passwd"/></robot>',
    ],
    ids=["depth", "number", "bomb", "external parameter entity", "external entity", "include"],
)
def test_a_urdf_made_to_harm(text: str) -> None:
    start_s = time.process_time()
    with pytest.raises(BadInputError) as caught:
        parse_urdf(text, "x.urdf")
    assert "root:" not in str(caught.value)
    assert time.process_time() - start_s < _PROCESSOR_S


def test_a_station_file_that_names_a_device_or_a_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for name in ("/dev/zero", str(tmp_path / "pipe")):
        path = tmp_path / "station.toml"
        path.write_text(STATION_TOML.replace("exo.urdf", name))
        with pytest.raises(BadInputError, match=r"URDF named by exoskeleton.urdf .* is not a file"):
            load_station(path)
        with pytest.raises(BadInputError, match="is not a file"):
            load_station(Path(name))


def test_what_a_recording_carries_beside_its_own_is_not_kept(tmp_path: Path) -> None:
    good = Outsider(STATION_TOML).with_(options={"use_chunking": False}).write(tmp_path / "x.mcap").read_bytes()
    builder = RecordBuilder()
    for number in range(30):
        Attachment(0, 0, f"{number}", "text/plain", bytes(2_000_000)).write(builder)
        Metadata(f"{number}", {"x": "y" * 1_000_000}).write(builder)
        Channel(100 + number, f"/{number}", "json", {"x": "y" * 1_000_000}, 0).write(builder)
    end = good.rindex(b"\x0f" + (4).to_bytes(8, "little"))  # the DataEnd record
    path = tmp_path / "stuffed.mcap"
    path.write_bytes(good[:end] + builder.end() + good[end:])
    tracemalloc.start()
    try:
        scan = scan_file(path)
        kept_bytes, most_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert set(scan.attachments) == {"station.toml", "exoskeleton.urdf"}
    assert kept_bytes < 1_000_000
    assert most_bytes < 20_000_000
    assert len(list(Recording(path).events())) == 6


def test_a_recording_names_no_files_of_this_machine(tmp_path: Path) -> None:
    """The URDF of a recording is the one in it, whatever path its station file names."""
    secret = tmp_path / "secret.urdf"
    secret.write_text("<robot>secret</robot>")
    toml = STATION_TOML.replace("exo.urdf", str(secret))
    assert str(secret) in toml
    recording = Recording(Outsider(toml).write(tmp_path / "x.mcap"))
    assert "secret" not in recording.station.urdf_text
