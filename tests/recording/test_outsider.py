"""Recordings written with the `mcap` package alone are accepted; the variants the format allows are understood."""

import ast
import struct
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType

from ghest_drivers.samples import EncoderSample, RgbdFrame
from ghest_rt.recording.reader import Recording
from tests.recording import outsider
from tests.recording.conftest import STATION_TOML
from tests.recording.outsider import COLOR, DEPTH, HEIGHT, WIDTH, Calibration, Image, Outsider


def _frames(recording: Recording) -> list[RgbdFrame]:
    return [event for event in recording.events() if isinstance(event, RgbdFrame)]


def test_the_outsider_knows_nothing_of_our_code() -> None:
    tree = ast.parse(Path(outsider.__file__).read_text())
    modules = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert not [module for module in modules if module.startswith(("ghest", "foxglove", "google"))]


def test_a_recording_made_with_mcap_alone_is_accepted(tmp_path: Path) -> None:
    recording = Recording(Outsider(STATION_TOML).write(tmp_path / "o.mcap"))
    events = list(recording.events())
    assert recording.problems == []
    assert not recording.has_truth
    assert recording.duration_ns == 2500
    samples = [event for event in events if isinstance(event, EncoderSample)]
    assert [(s.seq, s.t_device_ns, s.t_arrival_ns, s.t_capture_ns) for s in samples] == [(0, 5, 2000, 1990), (1, 5, 3000, 2990)]
    np.testing.assert_array_equal(samples[0].angles_rad, [0.5, -1.0])
    frames = [event for event in events if isinstance(event, RgbdFrame)]
    assert [(f.info.name, f.seq) for f in frames] == [("r0", 0), ("r1", 0), ("r0", 1), ("r1", 1)]
    first = frames[0]
    assert (first.t_arrival_ns, first.t_capture_ns, first.t_depth_capture_ns, first.t_device_ns) == (2500, 2000, 1980, 2000)
    np.testing.assert_array_equal(first.color_rgb.ravel(), np.arange(WIDTH * HEIGHT * 3))
    assert first.depth_counts is not None
    np.testing.assert_array_equal(first.depth_counts.ravel(), np.arange(100, 100 + WIDTH * HEIGHT))
    assert first.info.color.distortion == (0.0,) * 5


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"use_chunking": False},
        {"chunk_size": 100},
        {"index_types": IndexType.NONE, "use_statistics": False, "use_summary_offsets": False},
        {"repeat_channels": False, "repeat_schemas": False},
        {"enable_crcs": False},
    ],
    ids=str,
)
def test_any_layout_of_the_mcap_file_will_do(tmp_path: Path, options: dict[str, object]) -> None:
    recording = Recording(Outsider(STATION_TOML, options=options).write(tmp_path / "o.mcap"))
    assert len(list(recording.events())) == 6
    assert recording.problems == []


def test_bgr_is_turned_into_rgb(tmp_path: Path) -> None:
    bgr = np.frombuffer(COLOR.data, np.uint8).reshape(HEIGHT, WIDTH, 3)[:, :, ::-1]
    recording = Recording(Outsider(STATION_TOML, color=Image("bgr8", bgr.tobytes())).write(tmp_path / "o.mcap"))
    assert _frames(recording)[0].color_rgb.tobytes() == COLOR.data


def test_padded_rows_are_understood(tmp_path: Path) -> None:
    def padded(image: Image, padding: int) -> Image:
        rows = np.frombuffer(image.data, np.uint8).reshape(HEIGHT, -1)
        data = np.pad(rows, ((0, 0), (0, padding)), constant_values=255).tobytes()
        return Image(image.encoding, data)

    how = Outsider(STATION_TOML, color=padded(COLOR, 5), depth=padded(DEPTH, 3))
    frame = _frames(Recording(how.write(tmp_path / "o.mcap")))[0]
    assert frame.color_rgb.tobytes() == COLOR.data
    assert frame.depth_counts is not None
    assert frame.depth_counts.tobytes() == DEPTH.data


def test_depth_in_metres_becomes_counts_and_nan_no_measurement(tmp_path: Path) -> None:
    metres = [0.1234, float("nan"), float("inf"), -float("inf"), -0.2, 0.0, 70.0, 65.535, 0.0004, 0.0006, 1e30, 0.25]
    depth = Image("32FC1", struct.pack("<12f", *metres))
    frame = _frames(Recording(Outsider(STATION_TOML, depth=depth).write(tmp_path / "o.mcap")))[0]
    assert frame.depth_counts is not None
    assert frame.depth_counts.dtype == np.uint16
    assert frame.depth_counts.ravel().tolist() == [123, 0, 0, 0, 0, 0, 0, 65535, 0, 1, 0, 250]


def test_colour_alone_is_a_recording_too(tmp_path: Path) -> None:
    how = Outsider(STATION_TOML, depth=None, leave_out=("/r0/depth/calibration", "/r1/depth/calibration"))
    recording = Recording(how.write(tmp_path / "o.mcap"))
    assert [frame.depth_counts for frame in _frames(recording)] == [None] * 4
    assert recording.problems == []


def test_distortion_is_read(tmp_path: Path) -> None:
    how = Outsider(STATION_TOML, calibration=Calibration(D=(0.1, -0.2, 0.003, 0.004)))
    assert Recording(how.write(tmp_path / "o.mcap")).camera_infos["r1"].color.distortion == (0.1, -0.2, 0.003, 0.004, 0.0)


def test_joints_in_another_order_are_put_right(tmp_path: Path) -> None:
    other = b'{"seq": 9, "t_device_ns": 0, "t_capture_ns": 9, "names": ["j1", "j0"], "angles_rad": [1.0, 2.0]}'
    recording = Recording(Outsider(STATION_TOML, extra=(("/encoders/joints", 9, 9000, other),)).write(tmp_path / "o.mcap"))
    last = list(recording.events())[-1]
    assert isinstance(last, EncoderSample)
    assert last.angles_rad.tolist() == [2.0, 1.0]


def test_topics_of_others_are_passed_over(tmp_path: Path) -> None:
    extra = (("/room/temperature", 0, 5000, b"\xff\x00"), ("/r2/color/image", 0, 5000, b"\xff"))
    recording = Recording(Outsider(STATION_TOML, extra=extra).write(tmp_path / "o.mcap"))
    assert len(list(recording.events())) == 6
    assert recording.problems == []
