"""From blocks of bytes to messages in the order of arrival, decompressed ahead on a second thread."""

import heapq
import struct
import zlib
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from io import BytesIO
from operator import attrgetter
from pathlib import Path
from typing import BinaryIO

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from ghest_rt.recording.scan import Block, Scan

_RECORD_HEAD = struct.Struct("<BQ")
_MESSAGE_HEAD = struct.Struct("<HIQQ")
_AHEAD = 3
_MAX_HELD_BYTES = 256 * 1024 * 1024

OnDamage = Callable[[Block, str], None]


@dataclass(frozen=True, slots=True)
class RawMessage:
    """A message, not decoded.

    Attributes:
        channel_id: Its channel.
        sequence: The sender's number.
        log_time_ns: Arrival.
        publish_time_ns: Capture.
        data: The payload, a view into its block.
        byte: Where its block begins in the file.
    """

    channel_id: int
    sequence: int
    log_time_ns: int
    publish_time_ns: int
    data: memoryview
    byte: int


class DamagedBlockError(Exception):
    """A block that cannot be decompressed, or whose checksum is wrong."""


def messages_by_arrival(path: Path, blocks: list[Block], on_damage: OnDamage) -> Iterator[RawMessage]:
    """Yield all messages in the order of log time, then of place in the file.

    Blocks may overlap in time; what is held back until no earlier message can come is limited to a size that only a file
    with false chunk times can exceed.

    Raises:
        OSError: The file cannot be read.
    """
    ordered = sorted(blocks, key=attrgetter("start_ns", "byte"))
    held: list[tuple[int, int, int, RawMessage]] = []
    held_bytes = 0
    for index, (block, data) in enumerate(_loaded(path, ordered, on_damage)):
        for number, message in enumerate(_checked_messages(block, data, on_damage)):
            heapq.heappush(held, (message.log_time_ns, block.byte, number, message))
            held_bytes += len(message.data)
        last = index + 1 == len(ordered)
        next_start_ns = 0 if last else ordered[index + 1].start_ns
        while held and (last or held[0][0] < next_start_ns or held_bytes > _MAX_HELD_BYTES):
            message = heapq.heappop(held)[3]
            held_bytes -= len(message.data)
            yield message


def messages_by_place(path: Path, blocks: list[Block], on_damage: OnDamage) -> Iterator[RawMessage]:
    """Yield all messages in file order, reading no further than asked.

    Raises:
        OSError: The file cannot be read.
    """
    with path.open("rb") as file:
        for block in blocks:
            yield from _checked_messages(block, _load_or_report(file, block, on_damage), on_damage)


def complete_channels(path: Path, scan: Scan) -> None:
    """Add the channels and schemas that stand only inside chunks, by reading them all (files cut off, or without summary).

    Raises:
        OSError: The file cannot be read.
    """
    if scan.whole and scan.channels:
        return
    with path.open("rb") as file:
        for block in scan.blocks:
            try:
                for opcode, body in _records(_load(file, block)):
                    stream = ReadDataStream(BytesIO(body)) if opcode in (Opcode.SCHEMA, Opcode.CHANNEL) else None
                    if stream and opcode == Opcode.SCHEMA:
                        schema = Schema.read(stream)
                        scan.schemas[schema.id] = schema.name
                    elif stream:
                        channel = Channel.read(stream)
                        scan.channels[channel.id] = channel
            except (DamagedBlockError, McapError, struct.error, UnicodeDecodeError, OverflowError):
                continue  # reported when its messages are asked for


def _loaded(path: Path, blocks: list[Block], on_damage: OnDamage) -> Iterator[tuple[Block, bytes]]:
    """Yield blocks with their records; reading and decompressing (both without the GIL) run a little ahead."""
    with path.open("rb") as file, ThreadPoolExecutor(1, thread_name_prefix="recording") as pool:
        ahead: deque[tuple[Block, Future[bytes]]] = deque()
        coming = iter(blocks)
        try:
            while True:
                while len(ahead) < _AHEAD and (block := next(coming, None)) is not None:
                    ahead.append((block, pool.submit(_load, file, block)))
                if not ahead:
                    return
                block, future = ahead.popleft()
                try:
                    data = future.result()
                except DamagedBlockError as error:
                    on_damage(block, str(error))
                    data = b""
                yield block, data
        finally:
            for _, future in ahead:
                future.cancel()


def _load_or_report(file: BinaryIO, block: Block, on_damage: OnDamage) -> bytes:
    try:
        return _load(file, block)
    except DamagedBlockError as error:
        on_damage(block, str(error))
        return b""


def _load(file: BinaryIO, block: Block) -> bytes:
    """Read, decompress and check one block. The sizes were limited when the file was scanned."""
    file.seek(block.data_byte)
    data = file.read(block.data_length)
    if len(data) < block.data_length:
        raise DamagedBlockError("the file has become shorter")
    try:
        if block.compression == "zstd":
            stated = zstandard.frame_content_size(data)
            if stated not in (-1, block.size):  # -1: not stated
                raise DamagedBlockError("its sizes contradict each other")
            data = zstandard.ZstdDecompressor().decompress(data, max_output_size=block.size)
        elif block.compression == "lz4":
            data = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=block.size)
        elif block.compression:
            raise DamagedBlockError(f"compression {block.compression!r} is not supported (use zstd, lz4 or none)")
    except (zstandard.ZstdError, RuntimeError, EOFError) as error:
        raise DamagedBlockError(f"cannot be decompressed ({error})") from error
    if len(data) != block.size:
        raise DamagedBlockError("its sizes contradict each other")
    if block.crc and zlib.crc32(data) != block.crc:
        raise DamagedBlockError("its checksum is wrong")
    return data


def _records(data: bytes) -> Iterator[tuple[int, memoryview]]:
    """Yield (opcode, body) of the records in a block.

    Raises:
        DamagedBlockError: A record reaches beyond the end.
    """
    view = memoryview(data)
    byte = 0
    while byte < len(view):
        if byte + _RECORD_HEAD.size > len(view):
            raise DamagedBlockError("a record reaches beyond its end")
        opcode, length = _RECORD_HEAD.unpack_from(view, byte)
        byte += _RECORD_HEAD.size
        if length > len(view) - byte:
            raise DamagedBlockError("a record reaches beyond its end")
        yield opcode, view[byte : byte + length]
        byte += length


def _checked_messages(block: Block, data: bytes, on_damage: OnDamage) -> Iterator[RawMessage]:
    """Yield the messages of a block, up to the first record that is damaged."""
    try:
        for opcode, body in _records(data):
            if opcode == Opcode.MESSAGE:
                if len(body) < _MESSAGE_HEAD.size:
                    raise DamagedBlockError("a message is too short")
                channel, sequence, log_ns, publish_ns = _MESSAGE_HEAD.unpack_from(body)
                yield RawMessage(channel, sequence, log_ns, publish_ns, body[_MESSAGE_HEAD.size :], block.byte)
    except DamagedBlockError as error:
        on_damage(block, str(error))
