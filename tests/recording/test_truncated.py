"""A recording that is cut off or damaged is used as far as it goes, and never ends in a traceback."""

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ghest_drivers.samples import RgbdFrame
from ghest_rt.errors import BadInputError
from ghest_rt.messages.results import TruthSample
from ghest_rt.recording.decoding import Event
from ghest_rt.recording.problems import Skip
from ghest_rt.recording.reader import Recording
from ghest_rt.recording.scan import scan_file
from tests.recording.conftest import STATION_TOML
from tests.recording.outsider import Outsider


def _key(event: Event) -> tuple[str, int]:
    if isinstance(event, TruthSample):
        return "truth", event.t_ns
    return (event.info.name if isinstance(event, RgbdFrame) else "encoders"), event.t_arrival_ns


@pytest.fixture
def many_chunks(material: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("ghest_rt.recording.writer._CHUNK_BYTES", 8_000)
    path: Path = material.write(tmp_path / "whole.mcap")
    return path


def test_it_is_used_up_to_the_cut_wherever_that_is(material: Any, many_chunks: Path, tmp_path: Path) -> None:
    whole = many_chunks.read_bytes()
    keys = [_key(event) for event in material.events]
    path = tmp_path / "cut.mcap"
    used_before = refused = 0
    for cut in range(0, len(whole), 131):
        path.write_bytes(whole[:cut])
        try:
            recording = Recording(path)
        except BadInputError as error:
            refused += 1
            assert used_before == 0, "once there is something to use, more of the file is no reason to refuse it"
            assert str(error).startswith(str(path))
            continue
        read = [_key(event) for event in recording.events()]
        assert read == keys[: len(read)]
        assert len(read) >= used_before
        (problem,) = recording.problems
        assert problem.skip is Skip.TRUNCATED
        assert problem.byte <= cut
        used_before = len(read)
    assert refused > 5
    assert used_before == len(keys)


def test_the_report_of_a_cut_says_byte_and_time(material: Any, many_chunks: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(many_chunks.read_bytes()[:-20_000])
    recording = Recording(path)
    last = list(recording.events())[-1]
    (problem,) = recording.problems
    assert _key(last)[1] <= problem.t_ns <= _key(material.events[-1])[1]
    assert f"byte {problem.byte}, t = {problem.t_ns * 1e-9:.6f} s" in str(problem)


def test_without_chunks_only_the_message_at_the_cut_is_lost(tmp_path: Path) -> None:
    whole = Outsider(STATION_TOML, options={"use_chunking": False}).write(tmp_path / "whole.mcap").read_bytes()
    path = tmp_path / "cut.mcap"
    end = whole.rindex(b"\x0f" + (4).to_bytes(8, "little"))  # the DataEnd record
    path.write_bytes(whole[: end - 1])
    recording = Recording(path)
    assert len(list(recording.events())) == 5
    assert [problem.skip for problem in recording.problems] == [Skip.TRUNCATED, Skip.UNPAIRED_DEPTH]


@pytest.mark.parametrize("chunked", [True, False])
def test_no_damage_ends_in_a_traceback(material: Any, many_chunks: Path, tmp_path: Path, chunked: bool) -> None:
    options = {"use_chunking": False, "enable_crcs": False}
    other = Outsider(STATION_TOML, options=options).write(tmp_path / "o.mcap")
    whole = many_chunks.read_bytes() if chunked else other.read_bytes()
    events = len(material.events) if chunked else 6
    rng = random.Random(5)
    path = tmp_path / "damaged.mcap"
    usable = reported = 0
    for _ in range(250):
        damaged = bytearray(whole)
        for _ in range(rng.choice((1, 1, 1, 30))):
            damaged[rng.randrange(len(damaged))] = rng.choice((0, 0xFF, rng.randrange(256)))
        path.write_bytes(damaged)
        try:
            recording = Recording(path)
            found = len(list(recording.events()))
        except BadInputError:
            continue
        usable += 1
        reported += bool(recording.problems)
        assert found <= events
    assert usable > 20
    assert reported > 5


def test_a_damaged_chunk_is_left_out_and_the_rest_used(material: Any, many_chunks: Path, tmp_path: Path) -> None:
    damaged = bytearray(many_chunks.read_bytes())
    middle = len(damaged) // 2
    damaged[middle : middle + 4] = b"\0\0\0\0"
    path = tmp_path / "damaged.mcap"
    path.write_bytes(damaged)
    recording = Recording(path)
    read = [_key(event) for event in recording.events()]
    keys = [_key(event) for event in material.events]
    assert len(keys) // 2 < len(read) < len(keys)
    assert [key for key in keys if key in read] == read
    assert Skip.DAMAGED_CHUNK in {problem.skip for problem in recording.problems}


def test_a_recording_that_cannot_be_opened_for_its_damage_does_not_blame_its_writer_alone(
    many_chunks: Path, tmp_path: Path
) -> None:
    damaged = bytearray(many_chunks.read_bytes())
    first = scan_file(many_chunks).blocks[0]
    damaged[first.data_byte : first.data_byte + 4] = b"\0\0\0\0"
    path = tmp_path / "damaged.mcap"
    path.write_bytes(damaged)
    with pytest.raises(BadInputError, match=rf"1 chunk damaged up to there \(first at byte {first.byte}: "):
        Recording(path)


def test_a_writer_that_died_leaves_a_recording(material: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from ghest_rt.recording.writer import RecordingWriter

    monkeypatch.setattr("ghest_rt.recording.writer._CHUNK_BYTES", 8_000)
    path = tmp_path / "died.mcap"
    writer = RecordingWriter(path, material.station, {})
    for info in material.infos.values():
        writer.add_camera(info, 0)
    for event in material.events:
        if isinstance(event, RgbdFrame):
            writer.write_frame(event)
        elif not isinstance(event, TruthSample):
            writer.write_encoder(event, material.joints)
    copy = tmp_path / "copy.mcap"  # what is on the disk while the writer has not been closed
    copy.write_bytes(path.read_bytes())
    recording = Recording(copy)
    frames = [event for event in recording.events() if isinstance(event, RgbdFrame)]
    writer.close()
    assert len(frames) > 6
    assert frames[0].depth_counts is not None
    first = next(event for event in material.events if isinstance(event, RgbdFrame))
    np.testing.assert_array_equal(frames[0].color_rgb, first.color_rgb)
