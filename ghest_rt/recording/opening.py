"""What must be known before the first event: the cameras with their calibrations, and the joints of the encoders."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from google.protobuf.message import DecodeError

from ghest_drivers.samples import CameraInfo, Intrinsics
from ghest_rt.errors import BadInputError
from ghest_rt.recording import layout, rows
from ghest_rt.recording.blocks import RawMessage
from ghest_rt.recording.images import UnusableImageError, color_image, depth_image
from ghest_rt.recording.problems import Skip
from ghest_rt.recording.scan import Scan
from ghest_rt.recording.streams import Kind, Stream

_MAX_SIDE_PX = 8192
_CALIBRATIONS = {Kind.COLOR: Kind.COLOR_CALIBRATION, Kind.DEPTH: Kind.DEPTH_CALIBRATION}
_WRITE_FIRST = "write calibrations and camera facts before the first image"


@dataclass(slots=True)
class Opening:
    """What was found, and the bytes it was found in (to notice later changes).

    Attributes:
        cameras: By name.
        joints: In the order in which the encoder samples have them.
        first: The first message of each calibration and camera topic.
    """

    cameras: dict[str, CameraInfo] = field(default_factory=dict)
    joints: tuple[str, ...] = ()
    first: dict[str, bytes] = field(default_factory=dict)


def read_opening(path: Path, scan: Scan, streams: dict[int, Stream], messages: Iterator[RawMessage]) -> Opening:
    """Read messages until every camera has shown a usable image and the encoders a sample.

    Raises:
        BadInputError: A stream holds nothing usable, an image contradicts its calibration, or a calibration is not one.
    """
    reader = _OpeningReader(path, streams)
    for message in messages:
        stream = streams.get(message.channel_id)
        if stream is not None:
            reader.take(stream, message)
        if not reader.waiting:
            return reader.opening
    cut = "" if scan.whole else f" before byte {scan.cut_byte}, where the file is cut off"
    problems = "".join(f"\n  {problem}" for problem in reader.problems.values())
    raise BadInputError(
        f"{path}: nothing usable on topic {', '.join(sorted(reader.waiting))}{cut}; record that stream too{problems}"
    )


class _OpeningReader:
    def __init__(self, path: Path, streams: dict[int, Stream]) -> None:
        self.opening = Opening()
        self.waiting = {s.topic for s in streams.values() if s.kind in (Kind.COLOR, Kind.ENCODER)}
        self.problems: dict[str, str] = {}
        self._path = path
        self._topics = {(s.kind, s.camera): s.topic for s in streams.values()}
        self._messages: dict[str, RawMessage] = {}

    def take(self, stream: Stream, message: RawMessage) -> None:
        """Take in one message."""
        if stream.kind in (Kind.CAMERA, Kind.COLOR_CALIBRATION, Kind.DEPTH_CALIBRATION):
            if stream.topic not in self._messages:
                self._messages[stream.topic] = message
                self.opening.first[stream.topic] = bytes(message.data)
        elif stream.topic in self.waiting or stream.kind is Kind.DEPTH:
            if stream.kind is Kind.ENCODER:
                self._encoder(stream, message)
            elif stream.kind in _CALIBRATIONS:
                self._image(stream, message)

    def _encoder(self, stream: Stream, message: RawMessage) -> None:
        try:
            _, self.opening.joints = rows.encoder_from_json(message.data, message.log_time_ns)
            self.waiting.discard(stream.topic)
        except ValueError as error:
            self.problems.setdefault(stream.topic, f"{_place(stream, message)}: {error}")

    def _image(self, stream: Stream, message: RawMessage) -> None:
        info = self._camera(stream, message)
        try:
            if stream.kind is Kind.COLOR:
                color_image(message.data, info.color)
                self.waiting.discard(stream.topic)
            else:
                depth_image(message.data, info.depth, info.depth_unit_m)
        except UnusableImageError as error:
            problem = f"{_place(stream, message)}: {error}"
            if error.skip is not Skip.DAMAGED_MESSAGE:  # so will be all that follow
                calibration = self._topics[_CALIBRATIONS[stream.kind], stream.camera]
                raise BadInputError(f"{self._path}: {problem}; correct the images or {calibration}") from error
            self.problems.setdefault(stream.topic, problem)

    def _camera(self, stream: Stream, message: RawMessage) -> CameraInfo:
        """Return the info of the image's camera, built from what came before its first image."""
        known = self.opening.cameras.get(stream.camera)
        if known is not None:
            return known
        color = self._intrinsics(Kind.COLOR_CALIBRATION, stream, message)
        has_depth = (Kind.DEPTH, stream.camera) in self._topics
        depth = self._intrinsics(Kind.DEPTH_CALIBRATION, stream, message) if has_depth else color
        facts = self._needed(Kind.CAMERA, stream, message)
        place = f"{self._path}: {self._topics[Kind.CAMERA, stream.camera]} at byte {facts.byte}"
        try:
            info = rows.camera_from_json(facts.data, color, depth)
        except ValueError as error:
            raise BadInputError(f"{place}: not a {layout.CAMERA_SCHEMA} ({error}); correct it") from error
        if info.name != stream.camera:
            raise BadInputError(f"{place}: it names camera {info.name!r}; its topic belongs to {stream.camera!r}")
        self.opening.cameras[stream.camera] = info
        return info

    def _needed(self, kind: Kind, image: Stream, message: RawMessage) -> RawMessage:
        topic = self._topics.get((kind, image.camera))
        found = self._messages.get(topic) if topic else None
        if found is None:
            missing = topic or layout.depth_calibration_topic(image.camera)
            raise BadInputError(f"{self._path}: {_place(image, message)} comes before {missing}; {_WRITE_FIRST}")
        return found

    def _intrinsics(self, kind: Kind, image: Stream, message: RawMessage) -> Intrinsics:
        found = self._needed(kind, image, message)
        try:
            return parse_calibration(found.data)
        except ValueError as error:
            topic = self._topics[kind, image.camera]
            raise BadInputError(f"{self._path}: {topic} at byte {found.byte}: {error}; correct it") from error


def parse_calibration(data: memoryview) -> Intrinsics:
    """Decode a foxglove.CameraCalibration.

    Raises:
        ValueError: Not such a message, or not a pinhole camera with plumb-bob distortion.
    """
    try:
        message = CameraCalibration.FromString(bytes(data))
    except DecodeError as error:
        raise ValueError(f"not a foxglove.CameraCalibration in protobuf ({error})") from error
    if not (0 < message.width <= _MAX_SIDE_PX and 0 < message.height <= _MAX_SIDE_PX):
        raise ValueError(f"an image of {message.width}x{message.height} px; sides are 1 to {_MAX_SIDE_PX} px")
    K, D = list(message.K), list(message.D)
    if len(K) != 9 or not np.isfinite(K).all() or min(K[0], K[4]) <= 0 or K[1] or K[3] or K[6:] != [0.0, 0.0, 1.0]:
        raise ValueError(f"K = {K} is not (fx, 0, cx, 0, fy, cy, 0, 0, 1)")
    if message.distortion_model != "plumb_bob" and any(D):
        raise ValueError(f"distortion model {message.distortion_model!r}, expected 'plumb_bob'")
    if len(D) > 5 or not np.isfinite(D).all():
        raise ValueError(f"D = {D} is not (k1, k2, p1, p2, k3)")
    k1, k2, p1, p2, k3 = D + [0.0] * (5 - len(D))
    return Intrinsics(message.width, message.height, K[0], K[4], K[2], K[5], (k1, k2, p1, p2, k3))


def _place(stream: Stream, message: RawMessage) -> str:
    t_s = message.log_time_ns * 1e-9
    return f"{stream.topic}, message {message.sequence} (byte {message.byte}, t = {t_s:.6f} s)"
