"""A camera on a machine too busy for it: every frame is old when it comes."""

import asyncio
from dataclasses import replace

from ghest_drivers.clock import VirtualClock
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, RgbdFrame
from ghest_rt.messages.published import EventKind
from ghest_rt.messages.results import MarkerObservation
from ghest_rt.service.camera_worker import CameraWorker
from ghest_rt.service.inputs import InputSettings, Severity
from tests.service.fakes import FakeCamera, FakePipeline, frame

MS = 1_000_000


class LateCamera(FakeCamera):
    """Has another frame whenever it is asked, after 20 ms, and each has been on its way for 50 ms."""

    def __init__(self, clock: VirtualClock, frames: int) -> None:
        super().__init__("r0")
        self._clock = clock
        self._left = frames

    def read(self, timeout_s: float) -> RgbdFrame:
        if not self._left:
            return super().read(timeout_s)
        self._left -= 1
        self._clock.sleep_until_ns(self._clock.now_ns() + 20 * MS)
        t_ns = self._clock.now_ns()
        return replace(frame("r0", 100 - self._left, t_ns - 52 * MS), t_arrival_ns=t_ns - 50 * MS)


class Listener:
    """Keeps what was observed."""

    def __init__(self) -> None:
        self.observed_seq: list[int] = []
        self.ended = asyncio.Event()

    def input_event(self, source: str, kind: EventKind, severity: Severity, message: str) -> None: ...

    def camera_connected(self, name: str, info: CameraInfo) -> None: ...

    def encoders_connected(self, info: EncoderInfo) -> None: ...

    def observed(self, observation: MarkerObservation) -> None:
        self.observed_seq.append(observation.seq)

    def encoder_sample(self, sample: EncoderSample) -> None: ...

    def input_ended(self, source: str, error: Exception | None) -> None:
        self.ended.set()


async def test_a_camera_whose_frames_are_always_late_is_seen_all_the_same() -> None:
    clock, listener = VirtualClock(1_000 * MS), Listener()
    camera = LateCamera(clock, frames=40)
    camera.script.put("end")
    settings = InputSettings(max_backlog_ns=30 * MS)
    worker = CameraWorker(
        name="r0", camera=camera, observe=FakePipeline().observe, listener=listener, clock=clock, settings=settings
    )
    worker.start(asyncio.get_running_loop())
    worker.go()
    async with asyncio.timeout(10.0):
        await listener.ended.wait()
    # Of every four, the three that were on their way already when the first of them came have given way to the fourth.
    assert listener.observed_seq == list(range(64, 101, 4))
    assert worker.counters.skipped == 30
