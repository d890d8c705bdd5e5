"""CAN frames to readings: DBC layout, assembly, counters, checksums."""

import math
import random
import struct

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ghest_drivers.errors import BadDeviceData
from ghest_drivers.hardware.encoders.assembly import FrameAssembler
from ghest_drivers.hardware.encoders.can_layout import CanDecoder, CanLayout
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection
from tests.hardware_encoders.can_senders import ARMEO_CHANNELS, ARMEO_LAYOUT, ODRIVE_DBC, armeo_frames

MS = 1_000_000
ANGLES = [1.0, -2.0, 3.5, 90.25, -45.0, 0.01, -0.01]


def armeo() -> tuple[CanDecoder, LinkStats]:
    stats = LinkStats()
    return CanDecoder(ARMEO_LAYOUT, ARMEO_CHANNELS, stats), stats


def feed(decoder: CanDecoder, frames: list[can.Message], t_ns: int) -> list[RawReading]:
    found = [
        decoder.feed(f.arbitration_id, bytes(f.data), t_ns + k * 100_000, t_ns + k * 100_000) for k, f in enumerate(frames)
    ]
    return [whole[0] for whole in found if whole is not None]


def test_three_frames_make_one_sample() -> None:
    decoder, stats = armeo()
    (reading,) = feed(decoder, armeo_frames(300, 200_000_020_000, ANGLES, status=2), MS)
    assert reading.counts == pytest.approx(ANGLES)
    assert (reading.seq, reading.status) == (44, 2)
    assert reading.ticks == 200_000_020_000 // 10_000 - (1 << 24)
    assert not stats.rejected


def test_any_order_of_the_frames_of_a_sample_will_do() -> None:
    decoder, _ = armeo()
    rng = random.Random(1)
    for seq in range(50):
        frames = armeo_frames(seq, seq * 15 * MS, ANGLES)
        rng.shuffle(frames)
        assert len(feed(decoder, frames, seq * 15 * MS)) == 1


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_a_lost_frame_costs_its_sample_and_no_other(lost: int) -> None:
    decoder, stats = armeo()
    seqs = []
    for seq in range(10):
        frames = armeo_frames(seq, seq * 15 * MS, ANGLES)
        if seq == 4:
            del frames[lost]
        seqs += [reading.seq for reading in feed(decoder, frames, seq * 15 * MS)]
    assert seqs == [0, 1, 2, 3, 5, 6, 7, 8, 9]
    assert stats.rejected == {Rejection.INCOMPLETE: 1}


def test_frames_of_different_samples_are_never_mixed() -> None:
    """Every combination of lost frames over three samples: what comes out is whole."""
    for mask in range(1 << 9):
        decoder, _ = armeo()
        frames = [frame for seq in range(3) for frame in armeo_frames(seq, seq * MS, [float(seq)] * 7)]
        got = feed(decoder, [frame for k, frame in enumerate(frames) if mask >> k & 1], 0)
        assert [reading.seq for reading in got] == [seq for seq in range(3) if mask >> (3 * seq) & 0b111 == 0b111]
        for reading in got:
            assert reading.counts == (float(reading.seq or 0),) * 7


def test_repeated_and_corrupt_frames_are_refused() -> None:
    decoder, stats = armeo()
    frames = armeo_frames(0, 0, ANGLES)
    bad = can.Message(arbitration_id=frames[1].arbitration_id, data=bytes(frames[1].data))
    bad.data[0] ^= 4
    short = can.Message(arbitration_id=frames[2].arbitration_id, data=bytes(frames[2].data)[:7])
    stranger = can.Message(arbitration_id=0x700, data=b"\x05")
    sent = [frames[0], frames[0], bad, frames[1], short, stranger, frames[2], frames[2]]
    assert len(feed(decoder, sent, 0)) == 1
    assert stats.rejected == {Rejection.DUPLICATE: 2, Rejection.BAD_CHECKSUM: 1, Rejection.BAD_FRAME: 1}


def test_parts_that_come_too_late_make_no_sample() -> None:
    decoder, stats = armeo()
    frames = armeo_frames(0, 0, ANGLES)
    assert feed(decoder, frames[:2], 0) == []
    assert feed(decoder, frames[2:], 50 * MS) == []
    assert stats.rejected == {Rejection.INCOMPLETE: 1}


def test_odrive_layout_unchanged_and_for_several_axes() -> None:
    channels = (
        Channel("j0", "Axis0_Get_Encoder_Estimates.Pos_Estimate", rad_per_count=math.tau),
        Channel("j1", "Axis0_Get_Encoder_Estimates.Pos_Estimate@0x29", rad_per_count=math.tau, sign=-1),
    )
    decoder = CanDecoder(CanLayout(ODRIVE_DBC), channels, LinkStats())
    assert decoder.frame_ids == (0x09, 0x29)
    assert decoder.feed(0x09, struct.pack("<ff", 0.25, 1.0), 5, 7) is None
    whole = decoder.feed(0x29, struct.pack("<ff", -0.125, 1.0), 6, 9)
    assert whole == (RawReading((0.25, -0.125), None, 5, 0), 7)


def test_without_a_counter_each_frame_comes_once() -> None:
    stats = LinkStats()
    assembler = FrameAssembler((1, 2), 5 * MS, stats)

    def add(key: int, value: float, t_ms: int) -> tuple[float, float] | None:
        whole = assembler.add(key, (value,), None, t_bus_ns=t_ms * MS, t_arrival_ns=t_ms * MS)
        return None if whole is None else (whole.values[1][0], whole.values[2][0])

    assert add(1, 1.0, 0) is None
    assert add(2, 1.5, 1) == (1.0, 1.5)
    assert add(1, 2.0, 10) is None
    assert add(1, 3.0, 20) is None
    assert add(2, 3.5, 21) == (3.0, 3.5)
    assert add(2, 4.5, 30) is None
    assert add(1, 5.0, 40) is None
    assert add(2, 5.5, 41) == (5.0, 5.5)
    assert stats.rejected == {Rejection.INCOMPLETE: 2}


@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=50))
def test_random_frames_neither_crash_nor_pass(frames: list[tuple[int, bytes]]) -> None:
    decoder, _ = armeo()
    for k, (frame_id, data) in enumerate(frames):
        assert decoder.feed(frame_id, data, k, k) is None
        assert decoder.feed(384 + frame_id % 3, data, k, k) is None


@pytest.mark.parametrize(
    ("layout", "source", "message"),
    [
        (CanLayout("BO_ nonsense"), "A.B", "DBC file is not valid"),
        (CanLayout(ODRIVE_DBC), "Nope.Pos_Estimate", "not in the DBC"),
        (CanLayout(ODRIVE_DBC), "Axis0_Get_Encoder_Estimates.Nope", "not in the DBC"),
        (CanLayout(ODRIVE_DBC), "Axis0_Get_Encoder_Estimates.Pos_Estimate@x", "not in the DBC"),
        (
            CanLayout(ODRIVE_DBC, counter_signal="Counter"),
            "Axis0_Get_Encoder_Estimates.Pos_Estimate",
            "lacks the signal Counter",
        ),
    ],
)
def test_layouts_that_do_not_fit_are_refused_by_name(layout: CanLayout, source: str, message: str) -> None:
    with pytest.raises(BadDeviceData, match=message):
        CanDecoder(layout, (Channel("j", source),), LinkStats())
