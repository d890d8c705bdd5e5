"""Devices whose samples go to a recorder on their way, and the output that records what is published."""

from typing import Protocol

from ghest_drivers.interfaces import EncoderLink, RgbdCamera, TellsVitals
from ghest_drivers.samples import CameraInfo, DeviceVitals, EncoderInfo, EncoderSample, RgbdFrame
from ghest_rt.messages.published import Event, EventKind, GhAngles, Health
from ghest_rt.messages.results import GhEstimate
from ghest_rt.recording import layout
from ghest_rt.service.inputs import Severity
from ghest_rt.service.recorder import Recorder
from ghest_rt.service.recorder_settings import drops_in_words

RECORDER = "recorder"


class RunningService(Protocol):
    """What the recorder needs of the service (`ghest_rt.service.loop.Service`)."""

    @property
    def anchor_ns(self) -> int | None:
        """Instant 0 of the grid of samples; None until it is known."""
        ...

    def input_event(self, source: str, kind: EventKind, severity: Severity, message: str) -> None:
        """Publish that something happened."""
        ...


class RecordedCamera:
    """An `RgbdCamera`: another one, with everything it delivers recorded."""

    def __init__(self, camera: RgbdCamera, recorder: Recorder) -> None:
        self._camera = camera
        self._recorder = recorder

    @property
    def info(self) -> CameraInfo:
        """See `RgbdCamera.info`."""
        return self._camera.info

    def vitals(self) -> DeviceVitals:
        """See `TellsVitals.vitals`."""
        return self._camera.vitals() if isinstance(self._camera, TellsVitals) else DeviceVitals()

    def open(self) -> None:
        """See `RgbdCamera.open`."""
        self._camera.open()
        self._recorder.camera(self._camera.info)

    def read(self, timeout_s: float) -> RgbdFrame:
        """See `RgbdCamera.read`."""
        frame = self._camera.read(timeout_s)
        self._recorder.frame(frame)
        return frame

    def close(self) -> None:
        """See `RgbdCamera.close`."""
        self._camera.close()


class RecordedEncoders:
    """An `EncoderLink`: another one, with everything it delivers recorded."""

    def __init__(self, link: EncoderLink, recorder: Recorder) -> None:
        self._link = link
        self._recorder = recorder

    @property
    def info(self) -> EncoderInfo:
        """See `EncoderLink.info`."""
        return self._link.info

    def vitals(self) -> DeviceVitals:
        """See `TellsVitals.vitals`."""
        return self._link.vitals() if isinstance(self._link, TellsVitals) else DeviceVitals()

    async def open(self) -> None:
        """See `EncoderLink.open`."""
        await self._link.open()

    async def read(self, timeout_s: float) -> EncoderSample:
        """See `EncoderLink.read`."""
        sample = await self._link.read(timeout_s)
        self._recorder.encoder(sample, self._link.info.joint_names)
        return sample

    async def close(self) -> None:
        """See `EncoderLink.close`."""
        await self._link.close()


class RecorderOutput:
    """An output of the service: records its messages and, once a second, tells what went wrong with the recording."""

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self._service: RunningService | None = None
        self._anchored = False
        self._told_drops = 0
        self._told_failure = False

    def attach(self, service: RunningService) -> None:
        """Name the service whose output this is; without, nobody is told and the grid is not recorded."""
        self._service = service

    def angles(self, message: GhAngles, estimate: GhEstimate) -> None:
        """Record a sample."""
        if not self._anchored and self._service is not None and self._service.anchor_ns is not None:
            self._anchored = True
            self._recorder.grid(self._service.anchor_ns)
        self._recorder.published(
            layout.ANGLES_TOPIC, message, seq=message.seq, t_publish_ns=message.t_publish_ns, t_ns=message.t_sample_ns
        )

    def health(self, message: Health) -> None:
        """Record the service's state; tell how the recording does."""
        self._recorder.published(layout.HEALTH_TOPIC, message, seq=message.seq, t_publish_ns=message.t_ns, t_ns=message.t_ns)
        counts = self._recorder.counts()
        drops = sum(counts.dropped.values())
        if counts.failure:
            if not self._told_failure:
                self._told_failure = True
                self._tell(EventKind.RECORDING_STOPPED, "error", counts.failure)
        elif drops > self._told_drops:
            self._told_drops = drops
            what = f"the disk is slower than the data: dropped {drops_in_words(counts.dropped)} so far"
            self._tell(EventKind.RECORDING_DROPS, "warning", what)

    def event(self, message: Event) -> None:
        """Record an event."""
        self._recorder.published(layout.EVENTS_TOPIC, message, seq=message.seq, t_publish_ns=message.t_ns, t_ns=message.t_ns)

    def _tell(self, kind: EventKind, severity: Severity, message: str) -> None:
        if self._service is not None:
            self._service.input_event(RECORDER, kind, severity, message)
