"""The service on scripted devices."""

import asyncio
from collections.abc import Awaitable, Callable

from ghest_drivers.samples import CameraInfo
from ghest_rt.service.clocks import ScaledClock
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.contract import PipelineLike, ServiceSettings, ServiceSummary
from ghest_rt.service.inputs import Backoff, InputSettings
from ghest_rt.service.loop import Service
from tests.service.fakes import END, Collector, FakeCamera, FakeEncoders, FakePipeline, encoder_sample, frame

LAG_NS = 20_000_000
QUICK = InputSettings(read_timeout_s=0.01, silent_after=2, lost_after=1000, backoff=Backoff(first_s=0.002, limit_s=0.01))


class Rig:
    """A service on fakes, on the host's clock at 200 Hz."""

    def __init__(
        self,
        inputs: InputSettings = QUICK,
        cameras: dict[str, FakeCamera] | None = None,
        observe_hook: Callable[[object], None] = lambda frame: None,
        pipeline: type[FakePipeline] = FakePipeline,
    ) -> None:
        self.clock = ScaledClock()
        self.cameras = cameras or {"r0": FakeCamera("r0"), "r1": FakeCamera("r1")}
        self.encoders = FakeEncoders()
        self.pipelines: list[FakePipeline] = []
        self.out = Collector()
        self.service = Service(
            settings=ServiceSettings(rate_hz=200.0, lag_ns=LAG_NS, inputs=inputs),
            cameras=self.cameras,
            encoders=self.encoders,
            make_pipeline=self._make,
            composer=AnglesComposer("right", "fake", "cal", unix_offset_ns=0, numbering=Numbering()),
            outputs=(self.out,),
            clock=self.clock,
        )
        self._hook = observe_hook
        self._pipeline = pipeline

    def _make(self, infos: dict[str, CameraInfo], joints: tuple[str, ...]) -> PipelineLike:
        self.pipelines.append(self._pipeline(self._hook))
        return self.pipelines[-1]

    def feed(self, seq: int = 0, cameras: tuple[str, ...] = ("r0", "r1")) -> int:
        t_ns = self.clock.now_ns()
        for name in cameras:
            self.cameras[name].script.put(frame(name, seq, t_ns))
        self.encoders.script.put_nowait(encoder_sample(seq, t_ns))
        return t_ns

    def end(self) -> None:
        for camera in self.cameras.values():
            camera.script.put(END)
        self.encoders.script.put_nowait(END)

    async def during(self, scene: Callable[[], Awaitable[None]]) -> ServiceSummary:
        """Run the service while `scene` plays, then stop it."""
        task = asyncio.create_task(self.service.run())
        try:
            await scene()
        finally:
            self.service.stop()
            summary = await task
        return summary
