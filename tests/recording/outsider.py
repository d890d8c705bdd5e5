"""Writes recordings with the `mcap` package alone, from docs/recording-format.md: nothing of ghest-rt is imported here."""

import json
import struct
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from mcap.writer import CompressionType, Writer

IDENTITY = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
WIDTH, HEIGHT = 4, 3


def varint(value: int) -> bytes:
    out = b""
    while value > 0x7F:
        out += bytes([value & 0x7F | 0x80])
        value >>= 7
    return out + bytes([value])


def varint_field(number: int, value: int) -> bytes:
    return varint(number << 3) + varint(value)


def bytes_field(number: int, value: bytes) -> bytes:
    return varint(number << 3 | 2) + varint(len(value)) + value


def fixed32_field(number: int, value: int) -> bytes:
    return varint(number << 3 | 5) + struct.pack("<I", value)


def doubles_field(number: int, values: list[float]) -> bytes:
    return bytes_field(number, struct.pack(f"<{len(values)}d", *values))


def timestamp(t_ns: int) -> bytes:
    return bytes_field(1, varint_field(1, t_ns // 10**9) + varint_field(2, t_ns % 10**9))


@dataclass(frozen=True)
class Image:
    """The fields of foxglove.RawImage."""

    encoding: str
    data: bytes
    width: int = WIDTH
    height: int = HEIGHT
    step: int = 0

    def encoded(self, t_ns: int = 0) -> bytes:
        return (
            timestamp(t_ns)
            + fixed32_field(2, self.width)
            + fixed32_field(3, self.height)
            + bytes_field(4, self.encoding.encode())
            + fixed32_field(5, self.step or len(self.data) // self.height)
            + bytes_field(6, self.data)
            + bytes_field(7, b"some_frame")
        )


@dataclass(frozen=True)
class Calibration:
    """The fields of foxglove.CameraCalibration."""

    width: int = WIDTH
    height: int = HEIGHT
    K: tuple[float, ...] = (5.0, 0.0, 1.5, 0.0, 5.0, 1.0, 0.0, 0.0, 1.0)
    D: tuple[float, ...] = ()
    model: str = "plumb_bob"

    def encoded(self) -> bytes:
        return (
            fixed32_field(2, self.width)
            + fixed32_field(3, self.height)
            + bytes_field(4, self.model.encode())
            + doubles_field(5, list(self.D))
            + doubles_field(6, list(self.K))
        )


COLOR = Image("rgb8", bytes(range(WIDTH * HEIGHT * 3)))
DEPTH = Image("16UC1", struct.pack(f"<{WIDTH * HEIGHT}H", *range(100, 100 + WIDTH * HEIGHT)))


@dataclass
class Outsider:
    """Everything that can be varied in a recording of two ticks.

    `topics` overrides (message encoding, schema name) of a topic; `leave_out` drops topics; `extra` adds messages
    (topic, sequence, time, payload) at the end.
    """

    station_toml: str
    format: str | None = "1"
    attachments: tuple[str, ...] = ("station.toml", "exoskeleton.urdf")
    color: Image = COLOR
    depth: Image | None = DEPTH
    calibration: Calibration = Calibration()
    camera_facts: dict[str, Any] = field(default_factory=dict)
    encoder: dict[str, Any] = field(default_factory=dict)
    topics: dict[str, tuple[str, str]] = field(default_factory=dict)
    leave_out: tuple[str, ...] = ()
    extra: tuple[tuple[str, int, int, bytes], ...] = ()
    options: dict[str, Any] = field(default_factory=dict)

    def write(self, path: Path) -> Path:
        with path.open("wb") as file:
            writer = Writer(file, **{"compression": CompressionType.ZSTD, **self.options})
            writer.start(profile="ghest")
            if self.format is not None:
                writer.add_metadata("ghest", {"format": self.format})
            for name in self.attachments:
                text = self.station_toml if name == "station.toml" else "<robot name='x'/>"
                writer.add_attachment(0, 0, name, "text/plain", text.encode())
            _Messages(writer, self).write()
            writer.finish()
        return path

    def with_(self, **changes: Any) -> Self:
        return replace(self, **changes)


class _Messages:
    def __init__(self, writer: Writer, how: Outsider) -> None:
        self.writer, self.how = writer, how
        self.channels: dict[str, int] = {}

    def put(
        self, topic: str, kind: tuple[str, str], seq: int, t_ns: int, data: bytes, *, capture_ns: int | None = None
    ) -> None:
        if topic in self.how.leave_out:
            return
        if topic not in self.channels:
            encoding, schema = self.how.topics.get(topic, kind)
            schema_id = self.writer.register_schema(schema, "protobuf", b"") if schema else 0
            self.channels[topic] = self.writer.register_channel(topic, encoding, schema_id)
        publish_ns = t_ns if capture_ns is None else capture_ns
        self.writer.add_message(self.channels[topic], log_time=t_ns, publish_time=publish_ns, sequence=seq, data=data)

    def write(self) -> None:
        how = self.how
        image, calibration, row = ("protobuf", "foxglove.RawImage"), ("protobuf", "foxglove.CameraCalibration"), ("json", "")
        for camera in ("r0", "r1"):
            facts = {
                "name": camera,
                "model": "home-made",
                "serial": "0",
                "depth_unit_m": 0.001,
                "color_from_depth": IDENTITY,
                "rate_hz": 30.0,
                **how.camera_facts,
            }
            self.put(f"/{camera}/info", row, 0, 1000, json.dumps(facts).encode())
            self.put(f"/{camera}/color/calibration", calibration, 0, 1000, how.calibration.encoded())
            self.put(f"/{camera}/depth/calibration", calibration, 0, 1000, how.calibration.encoded())
        for k in range(2):
            t_ns = 2000 + 1000 * k
            sample = {
                "seq": k,
                "t_device_ns": 5,
                "t_capture_ns": t_ns - 10,
                "names": ["j0", "j1"],
                "angles_rad": [0.5, -1],
                "battery": "full",
                **how.encoder,
            }
            self.put("/encoders/joints", row, k, t_ns, json.dumps(sample).encode(), capture_ns=t_ns - 10)
            for camera in ("r0", "r1"):
                if how.depth is not None:
                    self.put(f"/{camera}/depth/image", image, k, t_ns + 500, how.depth.encoded(t_ns), capture_ns=t_ns - 20)
                self.put(f"/{camera}/color/image", image, k, t_ns + 500, how.color.encoded(t_ns), capture_ns=t_ns)
        for topic, seq, t_ns, data in how.extra:
            kind = image if topic.endswith("image") else calibration if topic.endswith("calibration") else row
            self.put(topic, kind, seq, t_ns, data)
