"""Write recordings (docs/recording-format.md)."""

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Literal, Self, cast

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray
from pydantic import BaseModel

from ghest_drivers.samples import CameraInfo, EncoderSample, Intrinsics, RgbdFrame
from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.messages.results import TruthSample
from ghest_rt.recording import layout, rows
from ghest_rt.security.sealing import SealedFile

_CHUNK_BYTES = 1_000_000  # what a cut loses at most, beside the message that filled the chunk
_DATA_FIELD_KEY = bytes([6 << 3 | 2])  # RawImage.data, length-delimited
_COMPRESSION = {"zstd": CompressionType.ZSTD, "none": CompressionType.NONE}


@dataclass(frozen=True, slots=True)
class _CameraChannels:
    info: CameraInfo
    color: int
    depth: int | None
    device_time: int


class RecordingWriter:
    """Writes one recording; a context manager. Not thread-safe.

    The file is written in place, chunk by chunk: after a crash it is readable up to the last whole chunk. The same calls
    give the same bytes.

    Args:
        path: The file; replaced if it exists.
        station: The station file and URDF to carry along.
        facts: Free key-value facts about the recording, such as the command that made it.
        compression: "none" where the time of writing matters more than the size.
        recipients: Public keys that the file is sealed for while it is written; none for a plain file.

    Raises:
        BadInputError: The file cannot be created.
        GhestError: From any method: the disk is full or gone.
        ValueError: `facts` holds the reserved key `format`.
    """

    def __init__(
        self,
        path: Path,
        station: LoadedStation,
        facts: Mapping[str, str],
        compression: Literal["zstd", "none"] = "zstd",
        recipients: Sequence[str] = (),
    ) -> None:
        if "format" in facts:
            raise ValueError("the fact `format` is set by the writer")
        try:
            self._file = SealedFile(path, recipients) if recipients else path.open("wb")
        except OSError as error:
            raise BadInputError(f"{path}: cannot write the recording: {error.strerror or error}") from error
        self._path = path
        self._writer = Writer(cast(IO[Any], self._file), chunk_size=_CHUNK_BYTES, compression=_COMPRESSION[compression])
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._cameras: dict[str, _CameraChannels] = {}
        try:
            self._begin(station, facts)
        except OSError as error:
            with suppress(OSError):  # what could not be written is tried again
                self._file.close()
            raise self._failed(error) from error

    def _begin(self, station: LoadedStation, facts: Mapping[str, str]) -> None:
        self._writer.start(profile=layout.PROFILE, library="ghest-rt")
        self._writer.add_metadata(layout.FACTS, {"format": layout.FORMAT_VERSION, **facts})
        for name, media_type, text in (
            (layout.STATION_ATTACHMENT, "application/toml", station.toml_text),
            (layout.URDF_ATTACHMENT, "application/xml", station.urdf_text),
        ):
            self._writer.add_attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=text.encode())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None) -> None:
        self.close()

    def add_camera(self, info: CameraInfo, t_ns: int, *, with_depth: bool = True) -> None:
        """Write a camera's facts and calibrations, before its first frame.

        Args:
            info: The camera.
            t_ns: When.
            with_depth: Whether it delivers depth images.

        Raises:
            ValueError: The camera has been added before.
        """
        if info.name in self._cameras:
            raise ValueError(f"camera {info.name} has been added before")
        channels = _CameraChannels(
            info,
            color=self._image_channel(layout.color_topic(info.name)),
            depth=self._image_channel(layout.depth_topic(info.name)) if with_depth else None,
            device_time=self._json_channel(layout.device_time_topic(info.name), layout.DEVICE_TIME_SCHEMA, rows.DeviceTimeRow),
        )
        self._cameras[info.name] = channels
        facts = self._json_channel(layout.camera_topic(info.name), layout.CAMERA_SCHEMA, rows.CameraRow)
        self._put(facts, 0, t_ns, t_ns, rows.camera_to_json(info))
        calibrations = [(layout.color_calibration_topic(info.name), info.color, info.name)]
        if with_depth:
            calibrations.append((layout.depth_calibration_topic(info.name), info.depth, f"{info.name}_depth"))
        for topic, intrinsics, frame_id in calibrations:
            schema = self._schema(layout.CALIBRATION_SCHEMA, "protobuf", layout.calibration_schema_data)
            channel = self._channel(topic, "protobuf", schema)
            self._put(channel, 0, t_ns, t_ns, _calibration(intrinsics, frame_id, t_ns))

    def write_frame(self, frame: RgbdFrame) -> None:
        """Write a frame: its device time where that is not the capture time, depth image, colour image.

        Raises:
            ValueError: The camera was not added, or not with depth, or an image does not have its calibration's size.
        """
        camera = self._cameras.get(frame.info.name)
        if camera is None:
            raise ValueError(f"frame of camera {frame.info.name} before add_camera")
        color, depth = camera.info.color, camera.info.depth
        _check("colour", frame.color_rgb, (color.height_px, color.width_px, 3), np.uint8)
        if frame.t_device_ns != frame.t_capture_ns:
            data = rows.device_time_to_json(frame.seq, frame.t_device_ns)
            self._put(camera.device_time, frame.seq, frame.t_arrival_ns, frame.t_capture_ns, data)
        if frame.depth_counts is not None:
            if camera.depth is None:
                raise ValueError(f"depth image of camera {frame.info.name}, which was added without depth")
            _check("depth", frame.depth_counts, (depth.height_px, depth.width_px), np.uint16)
            counts = frame.depth_counts.astype("<u2", copy=False)
            data = _image(counts, "16UC1", f"{camera.info.name}_depth", frame.t_depth_capture_ns)
            self._put(camera.depth, frame.seq, frame.t_arrival_ns, frame.t_depth_capture_ns, data)
        data = _image(frame.color_rgb, "rgb8", camera.info.name, frame.t_capture_ns)
        self._put(camera.color, frame.seq, frame.t_arrival_ns, frame.t_capture_ns, data)

    def write_encoder(self, sample: EncoderSample, names: tuple[str, ...]) -> None:
        """Write an encoder sample whose angles belong to the joints `names`, in that order.

        Raises:
            ValueError: `names` and the angles differ in number.
        """
        channel = self._json_channel(layout.ENCODER_TOPIC, layout.ENCODER_SCHEMA, rows.EncoderRow)
        self._put(channel, sample.seq, sample.t_arrival_ns, sample.t_capture_ns, rows.encoder_to_json(sample, names))

    def write_truth(self, truth: TruthSample) -> None:
        """Write the truth of one instant."""
        channel = self._json_channel(layout.TRUTH_TOPIC, layout.TRUTH_SCHEMA, rows.TruthRow)
        self._put(channel, 0, truth.t_ns, truth.t_ns, rows.truth_to_json(truth))

    def write_published(self, topic: str, message: BaseModel, *, seq: int, t_publish_ns: int, t_ns: int) -> None:
        """Write a message as it was published, for whoever wants to compare; it is not read back.

        Args:
            topic: Its topic.
            message: The message; its class gives the schema.
            seq: Its number.
            t_publish_ns: When it was published.
            t_ns: The instant it holds for.
        """
        kind = type(message)
        schema = self._schema(f"ghest.{kind.__name__}", "jsonschema", lambda: _json_schema(kind))
        channel = self._channel(topic, "json", schema)
        self._put(channel, seq, t_publish_ns, t_ns, message.model_dump_json().encode())

    def write_grid(self, t_0_ns: int) -> None:
        """Write an instant of the grid on which a live run published, so that an off-line run can give the same instants.

        Raises:
            GhestError: The disk is full or gone.
        """
        try:
            self._writer.add_metadata(layout.GRID, {layout.GRID_T_0_NS: str(t_0_ns)})
        except OSError as error:
            raise self._failed(error) from error

    @property
    def size_bytes(self) -> int:
        """What has been written to the file so far; the chunk in the making is not."""
        return self._file.tell()

    def fileno(self) -> int:
        """Return the file's descriptor, for whoever sees to it that the disk has what was written."""
        return self._file.fileno()

    def flush(self) -> None:
        """End the chunk in the making: what was written until now survives the end of this process, however it comes.

        Raises:
            GhestError: The disk is full or gone.
        """
        try:
            self._writer.flush()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise self._failed(error) from error

    def close(self) -> None:
        """Write the index and close the file; harmless if done before.

        Raises:
            GhestError: The disk is full or gone.
        """
        if self._file.closed:
            return
        try:
            try:
                self._writer.finish()  # type: ignore[no-untyped-call]
            finally:
                self._file.close()
        except OSError as error:
            raise self._failed(error) from error

    def _put(self, channel: int, seq: int, arrival_ns: int, capture_ns: int, data: bytes) -> None:
        if self._file.closed:
            raise ValueError("the recording is closed")
        if min(arrival_ns, capture_ns) < 0:
            raise ValueError("times in a recording are not negative")
        if not 0 <= seq < 1 << 32:
            raise ValueError(f"sequence number {seq} does not fit 32 bits")
        try:
            self._writer.add_message(channel, log_time=arrival_ns, publish_time=capture_ns, sequence=seq, data=data)
            self._file.flush()  # what a chunk leaves in the buffer would be missing after a crash
        except OSError as error:
            raise self._failed(error) from error

    def _failed(self, error: OSError) -> GhestError:
        return GhestError(f"{self._path}: cannot write the recording: {error.strerror or error}; what was written can be read")

    def _image_channel(self, topic: str) -> int:
        return self._channel(topic, "protobuf", self._schema(layout.IMAGE_SCHEMA, "protobuf", layout.image_schema_data))

    def _json_channel(self, topic: str, name: str, row: type[rows.Row]) -> int:
        return self._channel(topic, "json", self._schema(name, "jsonschema", lambda: rows.json_schema(row)))

    def _schema(self, name: str, encoding: str, data: Callable[[], bytes]) -> int:
        if name not in self._schemas:
            self._schemas[name] = self._writer.register_schema(name, encoding, data())
        return self._schemas[name]

    def _channel(self, topic: str, encoding: str, schema: int) -> int:
        if topic not in self._channels:
            self._channels[topic] = self._writer.register_channel(topic, encoding, schema)
        return self._channels[topic]


def _check(what: str, image: NDArray[np.generic], shape: tuple[int, ...], dtype: type[np.generic]) -> None:
    if image.shape != shape or image.dtype != dtype:
        raise ValueError(f"{what} image is {image.dtype} {image.shape}, the calibration says {np.dtype(dtype)} {shape}")


def _image(pixels: NDArray[np.generic], encoding: str, frame_id: str, t_ns: int) -> bytes:
    """Serialise a foxglove.RawImage, the pixels put between the other fields here: the library would copy them twice more."""
    before = RawImage(
        timestamp=_timestamp(t_ns), width=pixels.shape[1], height=pixels.shape[0], encoding=encoding, step=pixels[0].nbytes
    )
    data_field = _DATA_FIELD_KEY + _varint(pixels.nbytes)
    after = RawImage(frame_id=frame_id)
    parts = (
        before.SerializeToString(deterministic=True),
        data_field,
        np.ascontiguousarray(pixels).data,
        after.SerializeToString(),
    )
    return b"".join(parts)


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 0x7F:
        encoded.append(value & 0x7F | 0x80)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)


def _json_schema(kind: type[BaseModel]) -> bytes:
    return json.dumps(kind.model_json_schema(mode="serialization"), sort_keys=True).encode()


def _calibration(intrinsics: Intrinsics, frame_id: str, t_ns: int) -> bytes:
    K = intrinsics.matrix
    message = CameraCalibration(
        timestamp=_timestamp(t_ns),
        frame_id=frame_id,
        width=intrinsics.width_px,
        height=intrinsics.height_px,
        distortion_model="plumb_bob",
        D=intrinsics.distortion,
        K=K.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=np.column_stack((K, np.zeros(3))).ravel().tolist(),
    )
    return bytes(message.SerializeToString(deterministic=True))


def _timestamp(t_ns: int) -> Timestamp:
    return Timestamp(seconds=t_ns // 1_000_000_000, nanos=t_ns % 1_000_000_000)
