"""Which channels of a file are the streams of a recording, and whether all that are needed are there."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path

from ghest_rt.errors import BadInputError
from ghest_rt.recording import layout
from ghest_rt.recording.scan import Scan


class Kind(Enum):
    """What a stream carries."""

    COLOR = auto()
    DEPTH = auto()
    COLOR_CALIBRATION = auto()
    DEPTH_CALIBRATION = auto()
    CAMERA = auto()
    DEVICE_TIME = auto()
    ENCODER = auto()
    TRUTH = auto()


@dataclass(frozen=True, slots=True)
class Stream:
    """One channel of a recording; `camera` is "" where it belongs to none."""

    kind: Kind
    camera: str
    topic: str


_CAMERA_TOPICS = {
    Kind.COLOR: layout.color_topic,
    Kind.DEPTH: layout.depth_topic,
    Kind.COLOR_CALIBRATION: layout.color_calibration_topic,
    Kind.DEPTH_CALIBRATION: layout.depth_calibration_topic,
    Kind.CAMERA: layout.camera_topic,
    Kind.DEVICE_TIME: layout.device_time_topic,
}
_PROTOBUF_SCHEMAS = {
    Kind.COLOR: layout.IMAGE_SCHEMA,
    Kind.DEPTH: layout.IMAGE_SCHEMA,
    Kind.COLOR_CALIBRATION: layout.CALIBRATION_SCHEMA,
    Kind.DEPTH_CALIBRATION: layout.CALIBRATION_SCHEMA,
}
_NEEDED = (Kind.CAMERA, Kind.COLOR_CALIBRATION, Kind.COLOR)


def find_streams(path: Path, scan: Scan, cameras: Iterable[str]) -> dict[int, Stream]:
    """Return the streams by channel id; topics that are not part of the format are left out.

    Raises:
        BadInputError: A needed topic is missing, or has another encoding or schema than it must.
    """
    needed = [Stream(Kind.ENCODER, "", layout.ENCODER_TOPIC)]
    known = {layout.ENCODER_TOPIC: needed[0], layout.TRUTH_TOPIC: Stream(Kind.TRUTH, "", layout.TRUTH_TOPIC)}
    for camera in cameras:
        for kind, topic_of in _CAMERA_TOPICS.items():
            stream = Stream(kind, camera, topic_of(camera))
            known[stream.topic] = stream
            if kind in _NEEDED:
                needed.append(stream)
    streams = {}
    for channel in scan.channels.values():
        if channel.topic in known:
            stream = known[channel.topic]
            _check_encoding(path, stream, channel.message_encoding, scan.schemas.get(channel.schema_id, ""))
            streams[channel.id] = stream
    present = {stream.topic for stream in streams.values()}
    missing = [stream.topic for stream in needed if stream.topic not in present]
    if missing:
        cut = "" if scan.whole else f" before byte {scan.cut_byte}, where the file is cut off"
        raise BadInputError(
            f"{path}: no topic {', '.join(missing)}{cut}; the station file in the recording needs it: "
            "record that stream too (docs/recording-format.md)"
        )
    return streams


def _check_encoding(path: Path, stream: Stream, encoding: str, schema: str) -> None:
    wanted_schema = _PROTOBUF_SCHEMAS.get(stream.kind, "")
    wanted_encoding = "protobuf" if wanted_schema else "json"
    if encoding != wanted_encoding:
        raise BadInputError(f"{path}: topic {stream.topic} has message encoding {encoding!r}; write it as {wanted_encoding!r}")
    if wanted_schema and schema != wanted_schema:
        raise BadInputError(f"{path}: topic {stream.topic} has schema {schema!r}; write it as {wanted_schema!r}")
