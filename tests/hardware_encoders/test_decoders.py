"""Bytes to readings: any split, any garbage, nothing wrong accepted, nothing kept for ever."""

import random
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ghest_drivers.hardware.encoders.binary_frame import BinaryFormat, BinaryFrameDecoder, documented_format
from ghest_drivers.hardware.encoders.checksums import CHECKSUMS
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection
from ghest_drivers.hardware.encoders.text_line import TextFormat, TextLineDecoder

BINARY = documented_format(2)
TEXT = TextFormat(("seq", "time", "a0", "a1", "status"), checksum="crc32", prefix="$ENC,", delimiter=",")
I32 = st.integers(-(2**31), 2**31 - 1)
READINGS = st.builds(
    RawReading,
    st.tuples(I32, I32),
    st.integers(0, 2**16 - 1),
    st.integers(0, 2**32 - 1),
    st.integers(0, 255),
)


def as_values(reading: RawReading) -> dict[str, float]:
    return {
        "seq": reading.seq or 0,
        "time": reading.ticks or 0,
        "status": reading.status,
        "a0": reading.counts[0],
        "a1": reading.counts[1],
    }


def binary_decoder(layout: BinaryFormat = BINARY) -> tuple[BinaryFrameDecoder, LinkStats]:
    stats = LinkStats()
    return BinaryFrameDecoder(layout, ("a0", "a1"), stats), stats


def text_decoder(layout: TextFormat = TEXT) -> tuple[TextLineDecoder, LinkStats]:
    stats = LinkStats()
    return TextLineDecoder(layout, ("a0", "a1"), stats), stats


def in_pieces(data: bytes, cuts: list[int]) -> list[bytes]:
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    return [data[a:b] for a, b in pairwise(edges)]


@given(st.lists(READINGS, max_size=8), st.lists(st.integers(0, 10_000), max_size=12))
def test_binary_frames_arrive_whole_however_they_are_cut(readings: list[RawReading], cuts: list[int]) -> None:
    decoder, stats = binary_decoder()
    stream = b"".join(BINARY.encode(as_values(reading)) for reading in readings)
    got = [reading for piece in in_pieces(stream, cuts) for reading in decoder.feed(piece)]
    assert got == readings
    assert stats.bytes_discarded == 0
    assert decoder.buffered_bytes == 0


@given(st.lists(READINGS, max_size=8), st.lists(st.integers(0, 10_000), max_size=12))
def test_text_lines_arrive_whole_however_they_are_cut(readings: list[RawReading], cuts: list[int]) -> None:
    decoder, stats = text_decoder()
    stream = b"\n" + b"".join(TEXT.encode(as_values(reading)) for reading in readings)
    got = [reading for piece in in_pieces(stream, cuts) for reading in decoder.feed(piece)]
    assert got == readings
    assert stats.bytes_discarded == 1


@settings(max_examples=300)
@given(st.lists(st.one_of(READINGS, st.binary(max_size=60)), max_size=10), st.integers(0, 40))
def test_binary_is_in_step_again_after_any_garbage(parts: list[RawReading | bytes], cut: int) -> None:
    """Garbage may be anything, also half a frame; each whole frame after it must come through."""
    decoder, _ = binary_decoder()
    sent = [part for part in parts if isinstance(part, RawReading)]
    stream = b"".join(part if isinstance(part, bytes) else BINARY.encode(as_values(part)) for part in parts)
    got = decoder.feed(BINARY.encode(as_values(RawReading((7, 7), 7, 7)))[cut % BINARY.size_bytes :])
    got = got[1:] if cut % BINARY.size_bytes == 0 else got
    got += decoder.feed(stream + bytes(BINARY.size_bytes))
    assert got == sent
    assert decoder.buffered_bytes < BINARY.size_bytes


@settings(max_examples=300)
@given(st.lists(st.one_of(READINGS, st.binary(max_size=60)), max_size=10))
def test_text_is_in_step_again_after_any_garbage(parts: list[RawReading | bytes]) -> None:
    decoder, _ = text_decoder()
    sent = [part for part in parts if isinstance(part, RawReading)]
    stream = b"\n" + b"".join(part + b"\n" if isinstance(part, bytes) else TEXT.encode(as_values(part)) for part in parts)
    assert decoder.feed(stream) == sent


@settings(max_examples=300)
@given(st.lists(st.binary(max_size=700), max_size=20))
def test_nothing_is_kept_for_ever(chunks: list[bytes]) -> None:
    binary, _ = binary_decoder()
    text, _ = text_decoder()
    for chunk in chunks:
        assert binary.feed(chunk) == []
        assert text.feed(chunk) == []
        assert binary.buffered_bytes < BINARY.size_bytes
        assert text.buffered_bytes <= TEXT.max_line_bytes


@pytest.mark.parametrize("name", sorted(CHECKSUMS))
def test_no_single_or_double_bit_error_and_no_burst_passes(name: str) -> None:
    layout = BinaryFormat(b"\xa5", (("a0", "i16"), ("a1", "i16")), checksum=name)
    frame = bytearray(layout.encode({"a0": 1234, "a1": -4321}))
    rng = random.Random(1)
    bits = len(frame) * 8
    errors = [(1 << bit) for bit in range(bits)]
    if name != "xor8":  # known not to see two errors in the same bit column
        errors += [(1 << a) | (1 << b) for a in range(bits) for b in range(a)]
        burst = CHECKSUMS[name].size_bytes * 8
        errors += [(rng.getrandbits(burst - 2) << 1 | 1 | 1 << (burst - 1)) << rng.randrange(bits - burst) for _ in range(500)]
    whole = int.from_bytes(frame, "big")
    for error in errors:
        decoder, _ = binary_decoder(layout)
        assert decoder.feed((whole ^ error).to_bytes(len(frame), "big")) == []


@pytest.mark.parametrize(
    ("name", "check"),
    [("crc32", 0xCBF43926), ("crc16_ccitt", 0x29B1), ("crc16_modbus", 0x4B37), ("crc8_j1850", 0x4B), ("xor8", 0x31)],
)
def test_published_check_values(name: str, check: int) -> None:
    assert CHECKSUMS[name].compute(b"123456789") == check


def test_documented_frame_byte_by_byte() -> None:
    """The example of docs/encoder-links.md."""
    frame = BINARY.encode({"seq": 1, "time": 15_000, "a0": 900_000, "a1": -1})
    assert frame.hex(" ") == "a5 5a 0f 01 00 98 3a 00 00 a0 bb 0d 00 ff ff ff ff 00 " + frame[-4:].hex(" ")
    assert int.from_bytes(frame[-4:], "little") == CHECKSUMS["crc32"].compute(frame[:-4])


def test_other_layouts_by_settings_alone() -> None:
    layout = BinaryFormat(
        b"\x02",
        (("status", "u8"), ("time", "u16"), ("pad", "u8"), ("a1", "f32"), ("a0", "i16"), ("length", "u8")),
        big_endian=True,
        length_counts="frame",
        checksum="crc16_modbus",
        checksum_covers_sync=False,
    )
    decoder, _ = binary_decoder(layout)
    assert decoder.feed(layout.encode({"a0": -5, "a1": 0.5, "time": 70_000, "status": 3})) == [
        RawReading((-5, 0.5), None, 70_000 - 65_536, 3)
    ]


def test_a_wrong_length_field_is_refused() -> None:
    frame = bytearray(BINARY.encode({}))
    frame[2] += 1
    frame[-4:] = CHECKSUMS["crc32"].compute(bytes(frame[:-4])).to_bytes(4, "little")
    decoder, stats = binary_decoder()
    assert decoder.feed(bytes(frame)) == []
    assert stats.rejected[Rejection.BAD_LENGTH] == 1


def test_the_first_line_may_be_half_a_line_and_is_dropped() -> None:
    layout = TextFormat(("a0", "a1"))
    decoder, stats = text_decoder(layout)
    assert decoder.feed(b"12.5;3\n112.5;4;\r\n") == [RawReading((112.5, 4.0))]
    assert stats.bytes_discarded == 7


@pytest.mark.parametrize(
    "line",
    ["1", "1;2;3", "1;x", "1;nan", "1;inf", "1;1_0", "1;0x10", "1;٣", "1;", ";1", "1;1e", "1;--1", "1,5;2", "1 2;3", ""],
)
def test_lines_that_are_not_numbers_are_refused(line: str) -> None:
    decoder, stats = text_decoder(TextFormat(("a0", "a1")))
    assert decoder.feed(b"\n" + line.encode() + b"\n7;8\n") == [RawReading((7.0, 8.0))]
    assert stats.rejected == {Rejection.BAD_FIELDS: 1}


@pytest.mark.parametrize(
    ("layout", "line", "wanted"),
    [
        (TextFormat(("a0", "a1"), decimal_comma=True), "1,5; -2,25;", RawReading((1.5, -2.25))),
        (TextFormat(("skip", "a1", "a0"), delimiter="\t"), "x\t1\t2", RawReading((2.0, 1.0))),
        (TextFormat(("time", "a0", "a1"), time_decimals=3), "12.34;1;2", RawReading((1.0, 2.0), ticks=12_340)),
        (TextFormat(("time", "a0", "a1"), time_decimals=3), "12;1;2", RawReading((1.0, 2.0), ticks=12_000)),
        (TextFormat(("a0", "a1"), delimiter=",", prefix="$E,", checksum="xor8"), "$E,1,2*46", RawReading((1.0, 2.0))),
        (TextFormat(("a0", "a1"), delimiter=","), "+1e1,.5", RawReading((10.0, 0.5))),
    ],
)
def test_line_layouts_by_settings_alone(layout: TextFormat, line: str, wanted: RawReading) -> None:
    decoder, _ = text_decoder(layout)
    assert decoder.feed(b"\n" + line.encode() + b"\n") == [wanted]


def test_text_with_decimals_in_time_survives_a_round_trip() -> None:
    layout = TextFormat(("time", "a0", "a1"), time_decimals=3)
    for ticks in (0, 7, 999, 1000, 12_340):
        decoder, _ = text_decoder(layout)
        assert decoder.feed(b"\n" + layout.encode({"time": ticks, "a0": 1, "a1": 2})) == [RawReading((1.0, 2.0), ticks=ticks)]


def test_a_line_without_end_is_dropped_and_the_next_is_read() -> None:
    decoder, stats = text_decoder(TextFormat(("a0", "a1"), max_line_bytes=64))
    assert decoder.feed(b"\n") == []
    for _ in range(100):
        assert decoder.feed(b"1" * 50) == []
        assert decoder.buffered_bytes <= 64
    assert decoder.feed(b"\n1;2\n") == [RawReading((1.0, 2.0))]
    assert stats.rejected == {Rejection.LINE_TOO_LONG: 1}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sync": b""}, "sync"),
        ({"fields": (("a0", "i17"),)}, "a0: type"),
        ({"fields": (("a0", "i16"), ("a0", "i16"))}, "twice"),
        ({"fields": (("seq", "i16"),)}, "seq must have an unsigned"),
        ({"checksum": "md5"}, "checksum"),
        ({"length_counts": "words"}, "length_counts"),
        ({"fields": tuple((f"a{k}", "f64") for k in range(200))}, "longer than"),
    ],
)
def test_senseless_frames_are_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        BinaryFormat(**{"sync": b"\xa5", "fields": (("a0", "i16"),), **arguments})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"delimiter": "--"}, "delimiter"),
        ({"delimiter": "."}, "delimiter"),
        ({"delimiter": ",", "decimal_comma": True}, "decimal comma"),
        ({"checksum": "md5"}, "checksum"),
        ({"fields": ()}, "fields"),
        ({"fields": ("a0", "a0")}, "fields"),
        ({"time_decimals": 10}, "time_decimals"),
        ({"prefix": "°"}, "prefix"),
    ],
)
def test_senseless_lines_are_refused(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        TextFormat(**{"fields": ("a0",), **arguments})  # type: ignore[arg-type]


def test_a_channel_without_its_field_is_refused() -> None:
    with pytest.raises(ValueError, match=r"no field 'a9'.*a0, a1"):
        BinaryFrameDecoder(BINARY, ("a9",), LinkStats())
    with pytest.raises(ValueError, match=r"no field 'seq'.*a0, a1"):
        TextLineDecoder(TEXT, ("seq",), LinkStats())
