"""The binary frame: sync, then fields, then a checksum. Bytes in, raw readings out; no I/O."""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from ghest_drivers.hardware.encoders.checksums import CHECKSUMS
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection

_CODES = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "u64": "Q", "i64": "q", "f32": "f", "f64": "d"}
_PAD = "pad"
_ROLES = ("length", "seq", "time", "status")
_MAX_FRAME_BYTES = 1024


@dataclass(frozen=True, slots=True)
class BinaryFormat:
    """Layout of a frame of fixed size.

    Attributes:
        sync: Bytes that every frame starts with.
        fields: (name, type) in the order sent. Names: "length", "seq", "time", "status", "pad", or any other for a value that a
            channel reads. Types: u8 i8 u16 i16 u32 i32 u64 i64 f32 f64.
        big_endian: Byte order of the fields and of the checksum.
        length_counts: What the field "length" holds: the bytes after it up to the checksum ("payload"), or all ("frame").
        checksum: Name in `CHECKSUMS`.
        checksum_covers_sync: Whether the checksum is over the entire frame before it, or leaves the sync bytes out.
    """

    sync: bytes
    fields: tuple[tuple[str, str], ...]
    big_endian: bool = False
    length_counts: str = "payload"
    checksum: str = "crc32"
    checksum_covers_sync: bool = True

    def __post_init__(self) -> None:
        if not self.sync:
            raise ValueError("sync: at least one byte is needed")
        if self.checksum not in CHECKSUMS:
            raise ValueError(f"checksum: {self.checksum!r} is none of {', '.join(CHECKSUMS)}")
        if self.length_counts not in {"payload", "frame"}:
            raise ValueError("length_counts: must be payload or frame")
        names = [name for name, _ in self.fields if name != _PAD]
        if len(set(names)) != len(names):
            raise ValueError("fields: a name occurs twice")
        for name, kind in self.fields:
            if kind not in _CODES:
                raise ValueError(f"fields: {name}: type {kind!r} is none of {', '.join(_CODES)}")
            if name in _ROLES and kind[0] != "u":
                raise ValueError(f"fields: {name} must have an unsigned integer type")
        if self.size_bytes > _MAX_FRAME_BYTES:
            raise ValueError(f"fields: a frame of {self.size_bytes} bytes is longer than {_MAX_FRAME_BYTES}")

    @property
    def struct(self) -> struct.Struct:
        """The fields between sync and checksum."""
        return struct.Struct((">" if self.big_endian else "<") + "".join(_CODES[kind] for _, kind in self.fields))

    @property
    def size_bytes(self) -> int:
        """Length of the whole frame."""
        return len(self.sync) + self.struct.size + CHECKSUMS[self.checksum].size_bytes

    @property
    def length_value(self) -> int | None:
        """What the field "length" must hold; None if there is none."""
        names = [name for name, _ in self.fields]
        if "length" not in names:
            return None
        if self.length_counts == "frame":
            return self.size_bytes
        prefix = "<" + "".join(_CODES[kind] for _, kind in self.fields[: names.index("length") + 1])
        return self.struct.size - struct.calcsize(prefix)

    def modulus(self, role: str) -> int | None:
        """Return where the field "seq" or "time" starts again; None if there is no such field."""
        return next((1 << 8 * struct.calcsize(_CODES[kind]) for name, kind in self.fields if name == role), None)

    def encode(self, values: dict[str, float]) -> bytes:
        """Return one frame as a device sends it; "length" and "pad" are filled in, seq and time wrapped."""
        items: list[float] = []
        for name, kind in self.fields:
            value = 0.0 if name == _PAD else values.get(name, 0)
            if name == "length":
                value = self.length_value or 0
            elif name in {"seq", "time"}:
                value = int(value) % (self.modulus(name) or 1)
            items.append(value if kind[0] == "f" else round(value))
        body = self.struct.pack(*items)
        frame = self.sync + body
        checksum = CHECKSUMS[self.checksum]
        order = "big" if self.big_endian else "little"
        value = checksum.compute(frame if self.checksum_covers_sync else body)
        return frame + value.to_bytes(checksum.size_bytes, "big" if order == "big" else "little")


class BinaryFrameDecoder:
    """Finds frames in a byte stream, in step again after garbage at any byte. Keeps less than one frame between calls.

    Args:
        layout: The frame.
        sources: Field read by each channel, in the order of the channels.
        stats: Where refusals are counted.

    Raises:
        ValueError: A source is not a field of the layout.
    """

    def __init__(self, layout: BinaryFormat, sources: Sequence[str], stats: LinkStats) -> None:
        names = [name for name, _ in layout.fields]
        for source in sources:
            if source not in names or source in _ROLES or source == _PAD:
                raise ValueError(f"no field {source!r} in the frame; its values are {', '.join(_value_names(names))}")
        self._stats = stats
        self._sync = layout.sync
        self._struct = layout.struct
        self._size = layout.size_bytes
        checksum = CHECKSUMS[layout.checksum]
        self._compute = checksum.compute
        self._checked_from = 0 if layout.checksum_covers_sync else len(layout.sync)
        self._body_at = len(layout.sync)
        self._checksum_at = self._size - checksum.size_bytes
        self._big_endian = layout.big_endian
        self._length = layout.length_value
        index = {name: position for position, name in enumerate(names)}
        self._length_index = index.get("length")
        self._seq_index, self._time_index, self._status_index = (index.get(role) for role in ("seq", "time", "status"))
        self._value_indices = tuple(index[source] for source in sources)
        self._buffer = b""

    @property
    def buffered_bytes(self) -> int:
        """Bytes kept for the next call; always less than one frame."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[RawReading]:
        """Return the readings that `data` completes, in order; any number of bytes may be given, also none."""
        buffer = self._buffer + data
        readings: list[RawReading] = []
        at = 0
        while True:
            start = buffer.find(self._sync, at)
            if start < 0:
                kept = _sync_prefix_at_end(buffer, at, self._sync)
                self._stats.bytes_discarded += len(buffer) - kept - at
                self._buffer = buffer[len(buffer) - kept :]
                return readings
            self._stats.bytes_discarded += start - at
            if len(buffer) - start < self._size:
                self._buffer = buffer[start:]
                return readings
            reading = self._frame(buffer[start : start + self._size])
            if isinstance(reading, RawReading):
                readings.append(reading)
                at = start + self._size
            else:
                self._stats.rejected[reading] += 1
                self._stats.bytes_discarded += 1
                at = start + 1

    def _frame(self, frame: bytes) -> RawReading | Rejection:
        values = self._struct.unpack_from(frame, self._body_at)
        if self._length_index is not None and values[self._length_index] != self._length:
            return Rejection.BAD_LENGTH
        expected = int.from_bytes(frame[self._checksum_at :], "big" if self._big_endian else "little")
        if self._compute(frame[self._checked_from : self._checksum_at]) != expected:
            return Rejection.BAD_CHECKSUM
        return RawReading(
            tuple([values[index] for index in self._value_indices]),
            None if self._seq_index is None else values[self._seq_index],
            None if self._time_index is None else values[self._time_index],
            0 if self._status_index is None else values[self._status_index],
        )


def documented_format(values: int) -> BinaryFormat:
    """Return the frame of docs/encoder-links.md: `values` angles a0, a1, … as i32 in 0.0001 degrees, time in microseconds."""
    angles = tuple((f"a{index}", "i32") for index in range(values))
    return BinaryFormat(b"\xa5\x5a", (("length", "u8"), ("seq", "u16"), ("time", "u32"), *angles, ("status", "u8")))


DOCUMENTED_RAD_PER_COUNT = math.radians(1e-4)


def _value_names(names: Sequence[str]) -> list[str]:
    return [name for name in names if name not in _ROLES and name != _PAD]


def _sync_prefix_at_end(buffer: bytes, at: int, sync: bytes) -> int:
    """Return how many bytes at the end of `buffer[at:]` could begin a sync word."""
    for count in range(min(len(sync) - 1, len(buffer) - at), 0, -1):
        if buffer.endswith(sync[:count]):
            return count
    return 0
