"""One walk over the records of an MCAP file without reading its images: what is there, where, and how far it is whole.

The readers of the `mcap` package need the footer, or decompress everything; this walk needs neither, so a recording cut off
by a crash opens as fast as a whole one. Layout of records: the MCAP specification, https://mcap.dev/spec.
"""

import struct
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema

from ghest_rt.errors import BadInputError
from ghest_rt.recording import layout
from ghest_rt.security.sealing import SEALED_MAGIC

MAGIC = b"\x89MCAP0\r\n"
MAX_SMALL_BYTES = 4_000_000  # any record but chunks and messages
MAX_CHUNK_BYTES = 256 * 1024 * 1024  # compressed or not
_RECORD_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_CHUNK_HEAD = struct.Struct("<QQQII")
_LENGTH = struct.Struct("<Q")
_RUN_BYTES = 1_000_000
# Others are left where they are: a file may hold any number of them.
_ATTACHMENTS = {layout.STATION_ATTACHMENT, layout.URDF_ATTACHMENT}
_METADATA = {layout.FACTS, layout.GRID}
_DECODABLE = {Opcode.SCHEMA, Opcode.CHANNEL, Opcode.ATTACHMENT, Opcode.METADATA}


@dataclass(frozen=True, slots=True)
class Block:
    """A chunk, or a run of messages written without chunks.

    Attributes:
        byte: Where its record begins in the file.
        data_byte: Where its (compressed) records begin.
        data_length: How many bytes of them there are.
        compression: "" for none.
        size: Bytes when decompressed.
        crc: CRC-32 of the decompressed records, 0 if unknown.
        start_ns: Earliest log time in it.
        end_ns: Latest log time in it.
    """

    byte: int
    data_byte: int
    data_length: int
    compression: str
    size: int
    crc: int
    start_ns: int
    end_ns: int


@dataclass(slots=True)
class Scan:
    """What a walk over a file found.

    Attributes:
        blocks: Where the messages are, in file order.
        schemas: Names by id, as far as they stand outside chunks (summary, or file without chunks).
        channels: By id, likewise.
        attachments: By name, the first of each.
        metadata: By name, the first of each.
        whole: Whether the walk reached the footer.
        cut_byte: Where the first record that is not whole begins, or where the file ends.
        cut_reason: What is wrong there.
    """

    blocks: list[Block] = field(default_factory=list)
    schemas: dict[int, str] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    whole: bool = False
    cut_byte: int = 0
    cut_reason: str = ""


class _CutError(Exception):
    """The file stops making sense here."""


def scan_file(path: Path) -> Scan:
    """Walk over the records of a file.

    Raises:
        BadInputError: No such file, empty, or not MCAP.
    """
    try:
        with path.open("rb") as file:
            magic = file.read(len(MAGIC))
            if not magic:
                raise BadInputError(f"{path}: the file is empty; record it again")
            if magic == SEALED_MAGIC[: len(MAGIC)]:
                raise BadInputError(f"{path}: this recording is sealed; ghest-rt decrypt opens it with your key")
            if magic != MAGIC:
                raise BadInputError(f"{path}: not an MCAP file (byte 0: {magic.hex(' ')}); see docs/recording-format.md")
            return _Walk(file, path.stat().st_size).run()
    except OSError as error:
        raise BadInputError(f"{path}: cannot read the recording: {error.strerror or error}") from error


class _Walk:
    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file = file
        self._size = size
        self._scan = Scan()
        self._run: Block | None = None

    def run(self) -> Scan:
        scan = self._scan
        byte = len(MAGIC)
        try:
            while not scan.whole:
                byte = self._record(byte)
        except _CutError as error:
            scan.cut_reason = str(error)
        except (McapError, struct.error, ValueError, OverflowError) as error:
            scan.cut_reason = f"a record that cannot be decoded ({error or type(error).__name__})"
        scan.cut_byte = byte
        self._end_run()
        return scan

    def _record(self, byte: int) -> int:
        """Take in the record at `byte`; return where the next one begins."""
        self._file.seek(byte)
        head = self._file.read(_RECORD_HEAD.size)
        if len(head) < _RECORD_HEAD.size:
            raise _CutError("the file ends")
        opcode, length = _RECORD_HEAD.unpack(head)
        data_byte = byte + _RECORD_HEAD.size
        if opcode == 0:
            raise _CutError("bytes that are no MCAP record")
        if data_byte + length > self._size:
            raise _CutError("the file ends within a record")
        if opcode == Opcode.CHUNK:
            self._end_run()
            self._chunk(byte, data_byte, length)
        elif opcode == Opcode.MESSAGE:
            self._message(byte, data_byte, length)
        elif opcode == Opcode.FOOTER:
            self._scan.whole = True
        elif opcode in _DECODABLE:
            self._small(opcode, length)
        return int(data_byte + length)

    def _small(self, opcode: int, length: int) -> None:
        if length > MAX_SMALL_BYTES:
            raise _CutError(f"a record of {length} bytes where {MAX_SMALL_BYTES} are the most")
        stream = ReadDataStream(BytesIO(self._file.read(length)))
        scan = self._scan
        if opcode == Opcode.ATTACHMENT:
            attachment = Attachment.read(stream)
            if attachment.name in _ATTACHMENTS:
                scan.attachments.setdefault(attachment.name, attachment.data)
        elif opcode == Opcode.METADATA:
            metadata = Metadata.read(stream)
            if metadata.name in _METADATA:
                scan.metadata.setdefault(metadata.name, metadata.metadata)
        elif opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            scan.schemas[schema.id] = schema.name
        else:
            channel = Channel.read(stream)
            channel.metadata = {}  # not used, and of any size
            scan.channels[channel.id] = channel

    def _chunk(self, byte: int, data_byte: int, length: int) -> None:
        head = self._file.read(_CHUNK_HEAD.size)
        start_ns, end_ns, size, crc, name_length = _CHUNK_HEAD.unpack(head)
        if name_length > 32:
            raise _CutError("a chunk with an unknown compression")
        compression = self._file.read(name_length).decode()
        (data_length,) = _LENGTH.unpack(self._file.read(_LENGTH.size))
        head_length = _CHUNK_HEAD.size + name_length + _LENGTH.size
        if head_length + data_length > length or max(size, data_length) > MAX_CHUNK_BYTES:
            raise _CutError("a chunk of impossible size")
        self._scan.blocks.append(Block(byte, data_byte + head_length, data_length, compression, size, crc, start_ns, end_ns))

    def _message(self, byte: int, data_byte: int, length: int) -> None:
        if not _MESSAGE_HEAD.size <= length <= MAX_CHUNK_BYTES:
            raise _CutError(f"a message of {length} bytes")
        log_time_ns = _MESSAGE_HEAD.unpack(self._file.read(_MESSAGE_HEAD.size))[2]
        end_byte = data_byte + length
        run = self._run
        if run is None or run.data_byte + run.data_length != byte or run.data_length > _RUN_BYTES:
            self._end_run()
            run = Block(byte, byte, 0, "", 0, 0, log_time_ns, log_time_ns)
        size = end_byte - run.data_byte
        start_ns, end_ns = min(run.start_ns, log_time_ns), max(run.end_ns, log_time_ns)
        self._run = Block(run.byte, run.data_byte, size, "", size, 0, start_ns, end_ns)

    def _end_run(self) -> None:
        if self._run is not None:
            self._scan.blocks.append(self._run)
            self._run = None
