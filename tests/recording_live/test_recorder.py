"""What the recorder takes is in the files, to the last bit; what it has to leave out is counted and told."""

import json
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

from ghest_drivers.samples import EncoderSample, RgbdFrame
from ghest_rt.errors import BadInputError
from ghest_rt.messages.published import EventKind
from ghest_rt.recording.reader import Recording, open_recordings
from ghest_rt.recording.writer import RecordingWriter
from ghest_rt.service.health import HealthMeter, SampleCounts
from ghest_rt.service.pacing import Pacer
from ghest_rt.service.recorder import Recorder
from ghest_rt.service.recorder_settings import RecorderSettings
from ghest_rt.service.recorder_taps import RecorderOutput
from tests.recording_live.conftest import PERIOD_NS, T0_NS, Feed, MakeRecorder, camera_info


def same(a: object, b: object) -> bool:
    if isinstance(a, RgbdFrame) and isinstance(b, RgbdFrame):
        times = ("seq", "t_device_ns", "t_arrival_ns", "t_capture_ns", "t_depth_capture_ns")
        return (
            a.info.name == b.info.name
            and all(getattr(a, key) == getattr(b, key) for key in times)
            and np.array_equal(a.color_rgb, b.color_rgb)
            and a.depth_counts is not None
            and b.depth_counts is not None
            and np.array_equal(a.depth_counts, b.depth_counts)
        )
    if isinstance(a, EncoderSample) and isinstance(b, EncoderSample):
        return a.seq == b.seq and a.t_capture_ns == b.t_capture_ns and a.angles_rad.tobytes() == b.angles_rad.tobytes()
    return False


def recorded(folder: Path) -> list[object]:
    return [event for recording in open_recordings(folder) for event in recording.events()]


@pytest.mark.parametrize("compress", [False, True])
def test_everything_taken_is_in_the_file_to_the_last_bit(make_recorder: MakeRecorder, tmp_path: Path, compress: bool) -> None:
    recorder = make_recorder(RecorderSettings(compress=compress))
    fed = Feed().into(recorder, range(40))
    counts = recorder.close()
    found = recorded(tmp_path)
    assert len(found) == len(fed)
    assert all(same(a, b) for a, b in zip(fed, found, strict=True))
    assert counts.written["/r0/color/image"] == counts.written["/r1/depth/image"] == counts.written["/encoders/joints"] == 40
    assert counts.dropped == {} and counts.failure == ""
    assert counts.written_bytes == sum(file.stat().st_size for file in tmp_path.iterdir())


def test_parts_follow_one_another_by_size_without_a_gap(make_recorder: MakeRecorder, tmp_path: Path) -> None:
    recorder = make_recorder(RecorderSettings(part_bytes=150_000, flush_ns=0))
    fed = Feed().into(recorder, range(80))
    recorder.grid(T0_NS + 17)
    fed += Feed().into(recorder, range(80, 160))
    counts = recorder.close()
    assert len(counts.parts) >= 4
    assert all(150_000 <= part.stat().st_size < 250_000 for part in counts.parts[:-1])
    found = recorded(tmp_path)
    assert len(found) == len(fed)
    assert all(same(a, b) for a, b in zip(fed, found, strict=True))
    recordings = [Recording(part) for part in counts.parts]
    assert [recording.facts["part"] for recording in recordings] == [str(k) for k in range(len(recordings))]
    assert all(recording.problems == [] for recording in recordings)
    grids = [recording.grid_t_0_ns for recording in recordings]
    assert grids[-1] == T0_NS + 17  # every part from there on, and the one it was noted in
    assert set(grids) <= {None, T0_NS + 17}


def test_parts_follow_one_another_by_time(make_recorder: MakeRecorder) -> None:
    recorder = make_recorder(RecorderSettings(part_ns=50 * PERIOD_NS))
    Feed().into(recorder, range(160))
    parts = recorder.close().parts
    assert len(parts) == 4
    assert [next(iter(Recording(part).events())).t_arrival_ns for part in parts[1:]] == [  # type: ignore[union-attr]
        T0_NS + k * 50 * PERIOD_NS for k in (1, 2, 3)
    ]


def test_no_part_begins_while_an_input_is_out(make_recorder: MakeRecorder) -> None:
    recorder = make_recorder(RecorderSettings(part_ns=50 * PERIOD_NS))
    feed = Feed()
    feed.into(recorder, range(20))
    feed.into(recorder, range(20, 200), cameras=("r0",))
    feed.into(recorder, range(200, 230))
    parts = recorder.close().parts
    firsts = [next(iter(Recording(part).events())).t_arrival_ns for part in parts]  # type: ignore[union-attr]
    assert firsts == [T0_NS, T0_NS + 200 * PERIOD_NS]  # when r1 is back, not after 0.5, 1.0 and 1.5 s


def test_a_camera_that_comes_back_with_another_calibration_begins_a_part(make_recorder: MakeRecorder) -> None:
    recorder, feed = make_recorder(), Feed()
    feed.into(recorder, range(5))
    feed.infos["r1"] = camera_info("r1", fx_px=31.0)
    recorder.camera(feed.infos["r1"])
    feed.into(recorder, range(5, 10))
    parts = recorder.close().parts
    assert [Recording(part).camera_infos["r1"].color.fx_px for part in parts] == [30.0, 31.0]


def test_the_names_of_the_files_tell_station_start_and_part(make_recorder: MakeRecorder) -> None:
    parts = make_recorder().close().parts
    assert [part.name for part in parts] == ["test-20231114T221320Z-000.mcap"]
    with pytest.raises(BadInputError, match="exists already"):
        make_recorder()


def test_a_folder_that_cannot_be_written_is_told_at_once(make_recorder: MakeRecorder, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(BadInputError, match="name another folder"):
        make_recorder(folder=tmp_path / "file" / "recordings")


class SlowDisk:
    """Holds every frame up until released."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.released = threading.Event()
        self.reached = threading.Event()
        write = RecordingWriter.write_frame

        def held(writer: RecordingWriter, frame: RgbdFrame) -> None:
            self.reached.set()
            assert self.released.wait(20.0)
            write(writer, frame)

        monkeypatch.setattr(RecordingWriter, "write_frame", held)


class Told:
    """A service that notes what it is told to publish."""

    anchor_ns: int | None = None

    def __init__(self) -> None:
        self.events: list[tuple[EventKind, str, str]] = []

    def input_event(self, source: str, kind: EventKind, severity: str, message: str) -> None:
        assert source == "recorder"
        self.events.append((kind, severity, message))


def tick(output: RecorderOutput) -> None:
    pacer: Any = Pacer(lambda: 0, lambda t_ns: t_ns, lambda k, t_ns: None)
    output.health(HealthMeter(0, SampleCounts(), pacer, {}).measure(0, 1, 1))


def output_of(recorder: Recorder) -> tuple[RecorderOutput, Told]:
    output, told = RecorderOutput(recorder), Told()
    output.attach(told)
    return output, told


def test_a_disk_slower_than_the_data_costs_frames_and_each_is_counted_and_told(
    make_recorder: MakeRecorder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    disk = SlowDisk(monkeypatch)
    frame_bytes = 32 * 24 * 5
    recorder, feed = make_recorder(RecorderSettings(queue_bytes=20 * frame_bytes)), Feed()
    output, told = output_of(recorder)
    tick(output)
    assert told.events == []
    first = feed.into(recorder, range(1))
    assert disk.reached.wait(10.0)
    fed = first + feed.into(recorder, range(1, 50))
    tick(output)
    tick(output)
    assert len(told.events) == 1  # not again while nothing more is lost
    kind, severity, text = told.events[0]
    assert (kind, severity) == (EventKind.RECORDING_DROPS, "warning")
    dropped = recorder.counts().dropped
    assert set(dropped) == {f"/{camera}/{what}/image" for camera in ("r0", "r1") for what in ("color", "depth")}
    assert 60 <= dropped["/r0/color/image"] + dropped["/r1/color/image"] <= 85
    assert f"{dropped['/r0/depth/image']} on /r0/depth/image" in text
    disk.released.set()
    recorder.close()
    found = recorded(tmp_path)
    assert sum(isinstance(event, EncoderSample) for event in found) == 50  # none of the small ones
    frames = sum(isinstance(event, RgbdFrame) for event in found)
    assert frames + dropped["/r0/color/image"] + dropped["/r1/color/image"] == 100
    assert same(fed[0], found[0])


def test_frames_that_contradict_their_camera_are_left_out_and_counted(make_recorder: MakeRecorder, tmp_path: Path) -> None:
    recorder, feed = make_recorder(), Feed()
    feed.into(recorder, range(3))
    recorder.frame(Feed(16, 12).frame("r0", 3))
    feed.into(recorder, range(4, 6))
    counts = recorder.close()
    assert counts.dropped == {"/r0/color/image": 1, "/r0/depth/image": 1}
    assert [event.seq for event in recorded(tmp_path) if isinstance(event, RgbdFrame) and event.info.name == "r0"] == [
        0,
        1,
        2,
        4,
        5,
    ]


def test_a_disk_that_hangs_at_the_end_is_left_behind(make_recorder: MakeRecorder, monkeypatch: pytest.MonkeyPatch) -> None:
    disk = SlowDisk(monkeypatch)
    recorder = make_recorder(RecorderSettings(drain_s=0.2))
    Feed().into(recorder, range(1))
    assert disk.reached.wait(10.0)
    assert "did not take the last data within 0.2 s" in recorder.close().failure
    disk.released.set()


def test_what_was_published_is_in_the_file_with_its_schema(make_recorder: MakeRecorder) -> None:
    recorder = make_recorder()
    output, _ = output_of(recorder)
    Feed().into(recorder, range(2))
    tick(output)
    part = recorder.close().parts[0]
    with part.open("rb") as file:
        found = [(schema, message) for schema, channel, message in make_reader(file).iter_messages(topics="/health")]
    ((schema, message),) = found
    assert schema is not None and schema.name == "ghest.Health"
    assert set(json.loads(message.data)) == set(json.loads(schema.data)["properties"])
    assert sum(1 for _ in Recording(part).events()) == 6  # and is passed over when the recording is used
