"""What is written comes back bit for bit, in the order of arrival."""

import random
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from ghest_drivers.samples import EncoderSample, RgbdFrame
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.messages.results import TruthSample
from ghest_rt.recording.reader import Recording, open_recordings
from ghest_rt.recording.writer import RecordingWriter


def assert_same(a: Any, b: Any) -> None:
    """Equal to the last bit, arrays and nested dataclasses included."""
    assert type(a) is type(b)
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    elif hasattr(a, "__dataclass_fields__"):
        for field in fields(a):
            assert_same(getattr(a, field.name), getattr(b, field.name))
    else:
        assert a == b


@pytest.mark.parametrize("compression", ["zstd", "none"])
def test_every_type_comes_back_bit_for_bit(material: Any, tmp_path: Path, compression: str) -> None:
    recording = Recording(material.write(tmp_path / "a.mcap", compression=compression))
    events = list(recording.events())
    assert recording.problems == []
    assert len(events) == len(material.events)
    for written, read in zip(material.events, events, strict=True):
        assert_same(written, read)


def test_the_recording_says_what_it_is(material: Any, recording_path: Path) -> None:
    recording = Recording(recording_path)
    assert recording.facts == {"format": "1", "created_by": "test"}
    assert recording.has_truth
    assert recording.encoder_joints == ("j0", "j1")
    assert list(recording.camera_infos) == list(material.infos)
    for name, info in material.infos.items():
        assert_same(recording.camera_infos[name], info)
    assert recording.station.config == material.station.config
    assert (recording.station.toml_text, recording.station.urdf_text) == (
        material.station.toml_text,
        material.station.urdf_text,
    )
    arrivals = [e.t_ns if isinstance(e, TruthSample) else e.t_arrival_ns for e in material.events]
    assert recording.duration_ns == max(arrivals) - min(arrivals)


def test_the_same_calls_give_the_same_bytes(material: Any, tmp_path: Path) -> None:
    first, second = material.write(tmp_path / "a.mcap"), material.write(tmp_path / "b.mcap")
    assert first.read_bytes() == second.read_bytes()


def test_events_can_be_read_twice(recording_path: Path) -> None:
    recording = Recording(recording_path)
    first, second = list(recording.events()), list(recording.events())
    for a, b in zip(first, second, strict=True):
        assert_same(a, b)


def test_events_come_in_the_order_of_arrival_whatever_the_order_of_writing(material: Any, tmp_path: Path) -> None:
    shuffled = list(material.events)
    random.Random(3).shuffle(shuffled)
    path = type(material)(material.station, material.infos, material.joints, shuffled).write(tmp_path / "shuffled.mcap")
    events = list(Recording(path).events())
    for written, read in zip(material.events, events, strict=True):
        assert_same(written, read)


def test_repeated_and_reordered_encoder_rows_are_passed_on(material: Any, tmp_path: Path) -> None:
    samples = [e for e in material.events if isinstance(e, EncoderSample)]
    frames = [e for e in material.events if isinstance(e, RgbdFrame)]
    again = EncoderSample(
        *(getattr(samples[2], f) for f in ("seq", "angles_rad", "t_device_ns", "t_arrival_ns", "t_capture_ns"))
    )
    odd = [samples[0], samples[3], samples[2], again, samples[1]]
    odd = [EncoderSample(s.seq, s.angles_rad, s.t_device_ns, 10**12 + i, s.t_capture_ns) for i, s in enumerate(odd)]
    path = type(material)(material.station, material.infos, material.joints, [*odd, *frames]).write(tmp_path / "odd.mcap")
    read = [e.seq for e in Recording(path).events() if isinstance(e, EncoderSample)]
    assert read == [0, 3, 2, 2, 1]


def test_an_angle_that_is_no_number_stays_none(material: Any, tmp_path: Path) -> None:
    bad = EncoderSample(0, np.array([0.25, np.nan]), 1, 1, 1)
    path = type(material)(material.station, material.infos, material.joints, [*material.events, bad]).write(tmp_path / "n.mcap")
    first = next(e for e in Recording(path).events() if isinstance(e, EncoderSample))
    np.testing.assert_array_equal(first.angles_rad, [0.25, np.nan])


def test_the_writers_images_are_what_the_schema_says(recording_path: Path, material: Any) -> None:
    """A reader that knows only the schema in the file sees the right pixels."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    with recording_path.open("rb") as file:
        schema, _, message = next(make_reader(file).iter_messages(topics=["/r1/depth/image"]))
    assert schema is not None
    pool = descriptor_pool.DescriptorPool()
    files = descriptor_pb2.FileDescriptorSet.FromString(schema.data)
    for one in files.file:
        pool.Add(one)
    image = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString(message.data)
    frame = next(e for e in material.events if isinstance(e, RgbdFrame) and e.info.name == "r1")
    assert (image.encoding, image.step) == ("16UC1", image.width * 2)
    np.testing.assert_array_equal(np.frombuffer(image.data, "<u2").reshape(image.height, image.width), frame.depth_counts)
    assert image.timestamp.seconds * 10**9 + image.timestamp.nanos == frame.t_depth_capture_ns


def test_a_folder_is_its_recordings_by_name(material: Any, tmp_path: Path) -> None:
    for name in ("b.mcap", "a.mcap"):
        material.write(tmp_path / name)
    (tmp_path / "notes.txt").write_text("not a recording")
    assert [recording.path.name for recording in open_recordings(tmp_path)] == ["a.mcap", "b.mcap"]
    assert [recording.path.name for recording in open_recordings(tmp_path / "b.mcap")] == ["b.mcap"]


def test_a_folder_without_recordings_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"no recording \(\*\.mcap\)"):
        open_recordings(tmp_path)
    (tmp_path / "a.mcap.age").touch()
    with pytest.raises(BadInputError, match=r"only sealed recordings in this folder; ghest-rt decrypt"):
        open_recordings(tmp_path)


def test_the_writer_refuses_what_would_make_a_bad_recording(material: Any, tmp_path: Path) -> None:
    frame = next(e for e in material.events if isinstance(e, RgbdFrame))
    with pytest.raises(ValueError, match="set by the writer"):
        RecordingWriter(tmp_path / "x.mcap", material.station, {"format": "2"})
    with pytest.raises(BadInputError, match=r"nowhere.*cannot write"):
        RecordingWriter(tmp_path / "nowhere" / "x.mcap", material.station, {})
    with RecordingWriter(tmp_path / "x.mcap", material.station, {}) as writer:
        with pytest.raises(ValueError, match="before add_camera"):
            writer.write_frame(frame)
        writer.add_camera(frame.info, 0)
        with pytest.raises(ValueError, match="added before"):
            writer.add_camera(frame.info, 0)
        wrong = RgbdFrame(frame.info, 0, frame.color_rgb[:-1], None, 0, 0, 0, 0)
        with pytest.raises(ValueError, match="colour image is uint8"):
            writer.write_frame(wrong)
        with pytest.raises(ValueError, match="2 angles for 1"):
            writer.write_encoder(EncoderSample(0, np.zeros(2), 0, 0, 0), ("j0",))
        with pytest.raises(ValueError, match="not negative"):
            writer.write_encoder(EncoderSample(0, np.zeros(1), 0, -5, 0), ("j0",))
    with pytest.raises(ValueError, match="closed"):
        writer.write_encoder(EncoderSample(0, np.zeros(1), 0, 0, 0), ("j0",))


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_told(material: Any) -> None:
    with pytest.raises(GhestError, match=r"/dev/full: cannot write the recording: No space left"):
        material.write(Path("/dev/full"))
