"""Unusable recordings are refused with file, place and remedy; single bad messages are counted skips."""

import json
from pathlib import Path
from typing import Any

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk

from ghest_rt.errors import BadInputError
from ghest_rt.recording.problems import Skip
from ghest_rt.recording.reader import Recording
from tests.recording.conftest import STATION_TOML
from tests.recording.outsider import COLOR, DEPTH, IDENTITY, Calibration, Image, Outsider

_GOOD = Outsider(STATION_TOML)
_MAGIC = b"\x89MCAP0\r\n"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "the file is empty"),
        (b"\x89MCAP", "not an MCAP file"),
        (b"#ROSBAG V2.0\n" + bytes(100), "not an MCAP file (byte 0: 23 52 4f 53"),
        (_MAGIC, "not a ghest recording: no metadata record 'ghest' before byte 8"),
        (_MAGIC + bytes(1000), "not a ghest recording"),
    ],
)
def test_files_that_are_no_recording(tmp_path: Path, content: bytes, says: str) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(BadInputError) as caught:
        Recording(path)
    assert str(caught.value).startswith(str(path))
    assert says in str(caught.value)


def test_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"gone\.mcap: cannot read the recording: No such file"):
        Recording(tmp_path / "gone.mcap")


@pytest.mark.parametrize(
    ("how", "says"),
    [
        (_GOOD.with_(format=None), ["no metadata record 'ghest'"]),
        (_GOOD.with_(format="2"), ["recording format '2'", "reads '1'"]),
        (_GOOD.with_(attachments=("exoskeleton.urdf",)), ["attachment station.toml is missing"]),
        (_GOOD.with_(attachments=("station.toml",)), ["attachment exoskeleton.urdf is missing"]),
        (_GOOD.with_(station_toml="format = 1\nspeed = 3"), ["attachment station.toml", "speed", "station: is missing"]),
        (_GOOD.with_(station_toml=STATION_TOML + "#" * 1_000_001), ["station.toml is larger than 1000000 bytes"]),
        (_GOOD.with_(leave_out=("/encoders/joints",)), ["no topic /encoders/joints"]),
        (_GOOD.with_(leave_out=("/r1/color/image", "/r0/info")), ["no topic /r0/info, /r1/color/image"]),
        (_GOOD.with_(leave_out=("/r0/color/calibration",)), ["no topic /r0/color/calibration"]),
        (_GOOD.with_(leave_out=("/r0/depth/calibration",)), ["/r0/depth/image", "comes before /r0/depth/calibration"]),
        (_GOOD.with_(topics={"/r0/color/image": ("json", "foxglove.RawImage")}), ["/r0/color/image", "'json'", "'protobuf'"]),
        (
            _GOOD.with_(topics={"/r1/color/image": ("protobuf", "foxglove.CompressedImage")}),
            ["/r1/color/image", "'foxglove.CompressedImage'", "'foxglove.RawImage'"],
        ),
        (_GOOD.with_(topics={"/encoders/joints": ("cdr", "")}), ["/encoders/joints", "'cdr'", "'json'"]),
        (_GOOD.with_(color=Image("mono8", bytes(12))), ["/r0/color/image", "'mono8'", "rgb8 or bgr8", "byte", "t = 0.00000"]),
        (_GOOD.with_(depth=Image("rgb8", bytes(36))), ["/r0/depth/image", "'rgb8'", "16UC1 or 32FC1"]),
        (
            _GOOD.with_(color=Image("rgb8", bytes(18), width=3, height=2)),
            ["/r0/color/image", "3x2 px", "4x3 px", "/r0/color/calibration"],
        ),
        (_GOOD.with_(color=Image("rgb8", bytes(12), step=12)), ["nothing usable", "/r0/color/image", "12 bytes of pixels"]),
        (_GOOD.with_(color=Image("rgb8", bytes(36), step=3)), ["nothing usable", "step of 3"]),
        (_GOOD.with_(calibration=Calibration(width=0)), ["/r0/color/calibration", "0x3 px"]),
        (_GOOD.with_(calibration=Calibration(width=100_000)), ["100000x3 px"]),
        (_GOOD.with_(calibration=Calibration(K=(1.0, 2.0))), ["/r0/color/calibration", "is not (fx, 0, cx"]),
        (_GOOD.with_(calibration=Calibration(K=(float("nan"), 0, 1, 0, 5, 1, 0, 0, 1))), ["is not (fx, 0, cx"]),
        (_GOOD.with_(calibration=Calibration(D=(0.1,), model="kannala_brandt")), ["kannala_brandt", "plumb_bob"]),
        (_GOOD.with_(calibration=Calibration(D=(0.1,) * 8)), ["is not (k1, k2, p1, p2, k3)"]),
        (_GOOD.with_(camera_facts={"depth_unit_m": "1 mm"}), ["/r0/info", "depth_unit_m"]),
        (_GOOD.with_(camera_facts={"color_from_depth": [[2, 0, 0, 0], *IDENTITY[1:]]}), ["/r0/info", "not rigid"]),
        (_GOOD.with_(camera_facts={"name": "left"}), ["/r0/info", "'left'", "'r0'"]),
        (_GOOD.with_(encoder={"names": ["j0", "j7"]}), ["/encoders/joints lack j1"]),
        (_GOOD.with_(encoder={"angles_rad": [1.0]}), ["nothing usable", "/encoders/joints", "1 angles for 2"]),
        (_GOOD.with_(encoder={"names": ["j0", "j0"]}), ["nothing usable", "twice"]),
    ],
)
def test_recordings_that_cannot_be_used(tmp_path: Path, how: Outsider, says: list[str]) -> None:
    path = how.write(tmp_path / "x.mcap")
    with pytest.raises(BadInputError) as caught:
        Recording(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert [text for text in says if text not in message] == []


def _row(**changes: Any) -> bytes:
    row = {"seq": 7, "t_device_ns": 0, "t_capture_ns": 9000, "names": ["j0", "j1"], "angles_rad": [1.0, 2.0]}
    return json.dumps(row | changes).encode()


@pytest.mark.parametrize(
    ("topic", "data", "skip", "says"),
    [
        ("/encoders/joints", b"{not json", Skip.DAMAGED_MESSAGE, "Invalid JSON"),
        ("/encoders/joints", b'{"seq": 1}', Skip.DAMAGED_MESSAGE, "t_device_ns"),
        ("/encoders/joints", b"\xff\xfe", Skip.DAMAGED_MESSAGE, "JSON"),
        ("/encoders/joints", _row(angles_rad=[float("nan"), 1.0]), Skip.DAMAGED_MESSAGE, "angles_rad"),
        ("/encoders/joints", _row(angles_rad=["1", "2"]), Skip.DAMAGED_MESSAGE, "angles_rad"),
        ("/encoders/joints", _row(t_capture_ns=10**30), Skip.DAMAGED_MESSAGE, "t_capture_ns"),
        ("/encoders/joints", _row(names=["j0"], angles_rad=[1.0]), Skip.WRONG_JOINTS, "j0; the first has j0, j1"),
        ("/r0/color/image", b"\x0b\x0c", Skip.DAMAGED_MESSAGE, "not a foxglove.RawImage"),
        ("/r0/color/image", COLOR.encoded()[:-30], Skip.DAMAGED_MESSAGE, "ends within a field"),
        ("/r0/color/image", b"\xff" * 40, Skip.DAMAGED_MESSAGE, "varint"),
        ("/r0/color/image", Image("mono8", bytes(12)).encoded(), Skip.WRONG_ENCODING, "'mono8'"),
        ("/r0/color/image", Image("rgb8", bytes(6), 2, 1).encoded(), Skip.WRONG_SIZE, "2x1 px"),
        ("/r0/depth/image", Image("16UC1", bytes(4), 2, 1).encoded(), Skip.WRONG_SIZE, "2x1 px"),
        ("/r0/depth/image", DEPTH.encoded(), Skip.UNPAIRED_DEPTH, "no colour image with number 7 follows"),
        ("/r0/color/calibration", Calibration(D=(0.5,)).encoded(), Skip.CHANGED_CAMERA, "differs from the first"),
        ("/r1/info", b"{}", Skip.CHANGED_CAMERA, "differs from the first"),
        ("/r1/device_time", b"[]", Skip.DAMAGED_MESSAGE, "should be an object"),
        ("/truth/state", b"{}", Skip.DAMAGED_MESSAGE, "gh_from_arm"),
    ],
)
def test_a_single_bad_message_is_a_counted_skip(tmp_path: Path, topic: str, data: bytes, skip: Skip, says: str) -> None:
    extra = ((topic, 7, 9000, data), (topic, 7, 9500, data))
    recording = Recording(_GOOD.with_(extra=extra).write(tmp_path / "x.mcap"))
    for _ in range(2):  # a second pass counts anew
        assert len(list(recording.events())) == 6
        (problem,) = recording.problems
        assert (problem.skip, problem.topic, problem.count, problem.t_ns) == (skip, topic, 2, 9000)
        assert says in problem.detail
        assert f"{topic} {skip} x2" in str(problem)


def test_calibrations_repeated_unchanged_are_no_problem(tmp_path: Path) -> None:
    extra = (("/r0/color/calibration", 0, 9000, Calibration().encoded()),)
    recording = Recording(_GOOD.with_(extra=extra).write(tmp_path / "x.mcap"))
    list(recording.events())
    assert recording.problems == []


def test_a_chunk_that_would_unpack_to_more_than_it_says_is_not_unpacked(tmp_path: Path) -> None:
    builder = RecordBuilder()
    Chunk("zstd", zstandard.compress(bytes(50_000_000)), 9000, 8000, 0, 1000).write(builder)
    good = _GOOD.with_(options={"use_chunking": False}).write(tmp_path / "x.mcap").read_bytes()
    end = good.rindex(b"\x0f" + (4).to_bytes(8, "little"))  # the DataEnd record
    path = tmp_path / "bomb.mcap"
    path.write_bytes(good[:end] + builder.end() + good[end:])
    recording = Recording(path)
    assert len(list(recording.events())) == 6
    (problem,) = recording.problems
    assert (problem.skip, problem.byte, problem.detail) == (Skip.DAMAGED_CHUNK, end, "its sizes contradict each other")
