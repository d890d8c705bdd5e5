"""The text line: numbers between delimiters, a line feed at the end. Bytes in, raw readings out; no I/O."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from ghest_drivers.hardware.encoders.checksums import CHECKSUMS
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection

_ROLES = ("seq", "time", "status")
_IGNORED = "skip"
_INTEGER = re.compile(r"[0-9]{1,20}")
_NUMBER = re.compile(r"[+-]?(?:[0-9]{1,20}(?:\.[0-9]{0,20})?|\.[0-9]{1,20})(?:[eE][+-]?[0-9]{1,3})?")
_UNREADABLE = -1
_WRONG_POINT = "?"
_HEX = re.compile(rb"[0-9A-Fa-f]+")


@dataclass(frozen=True, slots=True)
class TextFormat:
    """Layout of a line.

    Attributes:
        fields: Names in the order sent: "seq", "status" (unsigned integers), "time" (unsigned), "skip", or any other for a
            number that a channel reads.
        delimiter: One character between fields. Blanks around a number are ignored; one after the last field is allowed.
        prefix: What every line starts with, for example "$ENC,".
        decimal_comma: Numbers are written with a comma.
        checksum: Name in `CHECKSUMS`, written in hexadecimal after "*" over what stands before it (a leading "$" left out, as
            in NMEA 0183); None for none.
        seq_modulus: Where the field "seq" starts again.
        time_decimals: Decimals of the field "time": one tick is its last decimal.
        time_modulus: Where the field "time" starts again, in ticks; None if it never does.
        max_line_bytes: A longer line is refused.
    """

    fields: tuple[str, ...]
    delimiter: str = ";"
    prefix: str = ""
    decimal_comma: bool = False
    checksum: str | None = None
    seq_modulus: int = 1 << 16
    time_decimals: int = 0
    time_modulus: int | None = 1 << 32
    max_line_bytes: int = 512

    def __post_init__(self) -> None:
        if len(self.delimiter) != 1 or not self.delimiter.isascii() or self.delimiter in "\r\n*+-.0123456789eE":
            raise ValueError("delimiter: must be one ASCII character that no number contains")
        if self.decimal_comma and self.delimiter == ",":
            raise ValueError("delimiter: cannot be a comma where numbers have a decimal comma")
        if self.checksum is not None and self.checksum not in CHECKSUMS:
            raise ValueError(f"checksum: {self.checksum!r} is none of {', '.join(CHECKSUMS)}")
        if not 0 <= self.time_decimals <= 9:
            raise ValueError("time_decimals: must be from 0 to 9")
        if not self.prefix.isascii() or "\n" in self.prefix:
            raise ValueError("prefix: must be ASCII text of one line")
        names = [name for name in self.fields if name != _IGNORED]
        if not names or len(set(names)) != len(names):
            raise ValueError("fields: must name at least one field, and none twice")

    def encode(self, values: dict[str, float]) -> bytes:
        """Return one line as a device sends it."""
        parts = []
        for name in self.fields:
            value = values.get(name, 0)
            if name == "seq":
                value = int(value) % self.seq_modulus
            elif name == "time" and self.time_modulus is not None:
                value = int(value) % self.time_modulus
            text = str(int(value)) if name in _ROLES else repr(float(value))
            if name == "time" and self.time_decimals:
                text = f"{text[: -self.time_decimals] or 0}.{text[-self.time_decimals :].zfill(self.time_decimals)}"
            parts.append(text.replace(".", ",") if self.decimal_comma else text)
        line = (self.prefix + self.delimiter.join(parts)).encode("ascii")
        if self.checksum is not None:
            checksum = CHECKSUMS[self.checksum]
            value_hex = f"{checksum.compute(line.removeprefix(b'$')):0{2 * checksum.size_bytes}X}"
            line += b"*" + value_hex.encode("ascii")
        return line + b"\r\n"


class TextLineDecoder:
    """Finds lines in a byte stream. What comes before the first line feed is dropped: it may be half a line.

    Args:
        layout: The line.
        sources: Field read by each channel, in the order of the channels.
        stats: Where refusals are counted.

    Raises:
        ValueError: A source is not a field of the layout.
    """

    def __init__(self, layout: TextFormat, sources: Sequence[str], stats: LinkStats) -> None:
        for source in sources:
            if source not in layout.fields or source in _ROLES or source == _IGNORED:
                known = [name for name in layout.fields if name not in _ROLES and name != _IGNORED]
                raise ValueError(f"no field {source!r} in the line; its values are {', '.join(known)}")
        self._layout = layout
        self._stats = stats
        self._prefix = layout.prefix.encode("ascii")
        self._checksum = None if layout.checksum is None else CHECKSUMS[layout.checksum]
        self._value_indices = tuple(layout.fields.index(source) for source in sources)
        self._seq_index, self._time_index, self._status_index = (
            layout.fields.index(role) if role in layout.fields else None for role in _ROLES
        )
        self._buffer = b""
        self._in_step = False

    @property
    def buffered_bytes(self) -> int:
        """Bytes kept for the next call; at most one line."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[RawReading]:
        """Return the readings that `data` completes, in order; any number of bytes may be given, also none."""
        *lines, rest = (self._buffer + data).split(b"\n")
        readings: list[RawReading] = []
        for line in lines:
            if not self._in_step:
                self._in_step = True
                self._stats.bytes_discarded += len(line) + 1
                continue
            reading = self._line(line)
            if isinstance(reading, RawReading):
                readings.append(reading)
            else:
                self._stats.rejected[reading] += 1
                self._stats.bytes_discarded += len(line) + 1
        if len(rest) > self._layout.max_line_bytes:
            if self._in_step:
                self._stats.rejected[Rejection.LINE_TOO_LONG] += 1
            self._stats.bytes_discarded += len(rest)
            self._in_step = False
            rest = b""
        self._buffer = rest
        return readings

    def _line(self, line: bytes) -> RawReading | Rejection:
        if len(line) > self._layout.max_line_bytes:
            return Rejection.LINE_TOO_LONG
        line = line.removesuffix(b"\r")
        if self._checksum is not None:
            line, star, stated = line.rpartition(b"*")
            if not star or len(stated) != 2 * self._checksum.size_bytes or not _HEX.fullmatch(stated):
                return Rejection.BAD_CHECKSUM
            if self._checksum.compute(line.removeprefix(b"$")) != int(stated, 16):
                return Rejection.BAD_CHECKSUM
        if not line.startswith(self._prefix) or not line.isascii():
            return Rejection.BAD_FIELDS
        text = line[len(self._prefix) :].decode("ascii")
        delimiter = self._layout.delimiter
        parts = [part.strip(" \t") for part in text.removesuffix(delimiter).split(delimiter)]
        if len(parts) != len(self._layout.fields):
            return Rejection.BAD_FIELDS
        return self._reading(parts)

    def _reading(self, parts: list[str]) -> RawReading | Rejection:
        counts = []
        for index in self._value_indices:
            text = self._with_point(parts[index])
            if not _NUMBER.fullmatch(text):
                return Rejection.BAD_FIELDS
            counts.append(float(text))
        seq, ticks, status = None, None, 0
        if self._seq_index is not None:
            seq = _unsigned(parts[self._seq_index])
        if self._time_index is not None:
            ticks = self._ticks(parts[self._time_index])
        if self._status_index is not None:
            status = _unsigned(parts[self._status_index])
        unreadable = (seq == _UNREADABLE, ticks == _UNREADABLE, status == _UNREADABLE)
        return Rejection.BAD_FIELDS if any(unreadable) else RawReading(tuple(counts), seq, ticks, status)

    def _with_point(self, text: str) -> str:
        if not self._layout.decimal_comma:
            return text
        return _WRONG_POINT if "." in text else text.replace(",", ".")

    def _ticks(self, text: str) -> int:
        whole, _, decimals = self._with_point(text).partition(".")
        if len(decimals) > self._layout.time_decimals:
            return _UNREADABLE
        return _unsigned(whole + decimals.ljust(self._layout.time_decimals, "0"))


def _unsigned(text: str) -> int:
    return int(text) if _INTEGER.fullmatch(text) else _UNREADABLE
