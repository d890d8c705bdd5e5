"""From raw messages to the frames and samples they hold; what cannot be used is counted."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from ghest_drivers.samples import CameraInfo, EncoderSample, RgbdFrame
from ghest_rt.messages.results import TruthSample
from ghest_rt.recording import rows
from ghest_rt.recording.blocks import RawMessage
from ghest_rt.recording.images import UnusableImageError, color_image, depth_image
from ghest_rt.recording.opening import Opening
from ghest_rt.recording.problems import ProblemLog, Skip
from ghest_rt.recording.streams import Kind, Stream

Event = RgbdFrame | EncoderSample | TruthSample


@dataclass(slots=True)
class _Awaited:
    """What came ahead of a camera's next colour image."""

    depth: tuple[RawMessage, NDArray[np.uint16]] | None = None
    device_time: tuple[int, int] | None = None  # (seq, t_device_ns)


def _told(error: ValueError) -> str:
    """The text of an error; of a JSON row's only which keys are wrong and how."""
    if not isinstance(error, ValidationError):
        return str(error)
    found = error.errors(include_url=False, include_input=False)
    return "; ".join(f"{'.'.join(map(str, item['loc']))}: {item['msg']}".removeprefix(": ") for item in found)


class EventDecoder:
    """Decodes the messages of one pass over a recording, in their order."""

    def __init__(self, streams: dict[int, Stream], opening: Opening, log: ProblemLog) -> None:
        self._streams = streams
        self._opening = opening
        self._log = log
        self._awaited = {camera: _Awaited() for camera in opening.cameras}

    def decode(self, message: RawMessage) -> Event | None:
        """Return what this message completes, if anything; skips are counted in the log."""
        stream = self._streams.get(message.channel_id)
        if stream is None:
            return None
        try:
            match stream.kind:
                case Kind.COLOR:
                    return self._frame(self._opening.cameras[stream.camera], message)
                case Kind.DEPTH:
                    self._depth(stream, self._opening.cameras[stream.camera], message)
                case Kind.ENCODER:
                    return self._encoder(stream, message)
                case Kind.TRUTH:
                    return rows.truth_from_json(message.data)
                case Kind.DEVICE_TIME:
                    self._awaited[stream.camera].device_time = rows.device_time_from_json(message.data)
                case Kind.CAMERA | Kind.COLOR_CALIBRATION | Kind.DEPTH_CALIBRATION:
                    self._constant(stream, message)
        except UnusableImageError as error:
            self._skip(error.skip, stream.topic, message, str(error))
        except ValueError as error:
            self._skip(Skip.DAMAGED_MESSAGE, stream.topic, message, " ".join(_told(error).split()))
        return None

    def finish(self) -> None:
        """Count what is left over at the end."""
        for camera in self._awaited:
            self._drop_depth(camera)

    def _frame(self, info: CameraInfo, message: RawMessage) -> RgbdFrame:
        awaited = self._awaited[info.name]
        if awaited.depth is not None and awaited.depth[0].sequence != message.sequence:
            self._drop_depth(info.name)
        depth, awaited.depth = awaited.depth, None
        device_time, awaited.device_time = awaited.device_time, None
        color_rgb = color_image(message.data, info.color)
        has_device_time = device_time is not None and device_time[0] == message.sequence
        return RgbdFrame(
            info=info,
            seq=message.sequence,
            color_rgb=color_rgb,
            depth_counts=None if depth is None else depth[1],
            t_device_ns=device_time[1] if device_time is not None and has_device_time else message.publish_time_ns,
            t_arrival_ns=message.log_time_ns,
            t_capture_ns=message.publish_time_ns,
            t_depth_capture_ns=message.publish_time_ns if depth is None else depth[0].publish_time_ns,
        )

    def _depth(self, stream: Stream, info: CameraInfo, message: RawMessage) -> None:
        self._drop_depth(stream.camera)
        self._awaited[stream.camera].depth = (message, depth_image(message.data, info.depth, info.depth_unit_m))

    def _drop_depth(self, camera: str) -> None:
        awaited = self._awaited[camera]
        if awaited.depth is not None:
            message = awaited.depth[0]
            detail = f"no colour image with number {message.sequence} follows"
            self._skip(Skip.UNPAIRED_DEPTH, self._streams[message.channel_id].topic, message, detail)
            awaited.depth = None

    def _encoder(self, stream: Stream, message: RawMessage) -> EncoderSample | None:
        sample, names = rows.encoder_from_json(message.data, message.log_time_ns)
        joints = self._opening.joints
        if names == joints:
            return sample
        if set(names) != set(joints):
            self._skip(Skip.WRONG_JOINTS, stream.topic, message, f"{', '.join(names)}; the first has {', '.join(joints)}")
            return None
        angles_rad = sample.angles_rad[[names.index(joint) for joint in joints]]
        return EncoderSample(sample.seq, angles_rad, sample.t_device_ns, sample.t_arrival_ns, sample.t_capture_ns)

    def _constant(self, stream: Stream, message: RawMessage) -> None:
        if bytes(message.data) != self._opening.first.get(stream.topic):
            self._skip(Skip.CHANGED_CAMERA, stream.topic, message, "it differs from the first one, which stays in use")

    def _skip(self, skip: Skip, topic: str, message: RawMessage, detail: str) -> None:
        self._log.add(skip, topic, message.byte, message.log_time_ns, detail)
