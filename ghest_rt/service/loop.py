"""The service: cameras and encoders in, one sample per grid slot out, whatever happens to the devices."""

import asyncio
import logging
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from ghest_drivers.interfaces import EncoderLink, RgbdCamera
from ghest_drivers.samples import CameraInfo, DeviceVitals, EncoderInfo, EncoderSample, RgbdFrame
from ghest_rt.errors import DeviceError
from ghest_rt.messages.published import EventKind
from ghest_rt.messages.results import MarkerObservation, Reason, Status
from ghest_rt.service.absence import at_the_end, waiting
from ghest_rt.service.alarm import Alarm, make_alarm
from ghest_rt.service.camera_worker import CameraWorker, same_camera
from ghest_rt.service.clocks import ServiceClock
from ghest_rt.service.compose import AnglesComposer
from ghest_rt.service.contract import MakePipeline, PipelineLike, ServiceSettings, ServiceSummary
from ghest_rt.service.drift_watch import DriftWatch
from ghest_rt.service.encoder_worker import ENCODERS, EncoderWorker
from ghest_rt.service.events import EventTeller
from ghest_rt.service.health import HealthMeter, SampleCounts, lateness
from ghest_rt.service.inputs import Severity
from ghest_rt.service.outputs import Output
from ghest_rt.service.pacing import Pacer
from ghest_rt.service.process import GarbageRounds
from ghest_rt.sync.grid import Grid

_log = logging.getLogger(__name__)

_STOP_TIMEOUT_S = 0.7  # SIGTERM must end the service within a second, even if a device hangs in its close
_HEALTH_PERIOD_NS = 1_000_000_000


class Service:
    """Runs until `stop` is called, or until the cameras have ended (recordings do)."""

    def __init__(
        self,
        *,
        settings: ServiceSettings,
        cameras: Mapping[str, RgbdCamera],
        encoders: EncoderLink,
        make_pipeline: MakePipeline,
        composer: AnglesComposer,
        outputs: Sequence[Output],
        clock: ServiceClock,
        make_alarm: Callable[[asyncio.AbstractEventLoop, Callable[[], None]], Alarm] = make_alarm,
    ) -> None:
        self._settings = settings
        self._make_pipeline = make_pipeline
        self._composer = composer
        self._outputs = outputs
        self._clock = clock
        self._make_alarm = make_alarm
        self._workers = {
            name: CameraWorker(
                name=name, camera=camera, observe=self._observe, listener=self, clock=clock, settings=settings.inputs
            )
            for name, camera in cameras.items()
        }
        self._encoder_worker = EncoderWorker(encoders, self, settings.inputs)
        self._counters = {name: worker.counters for name, worker in self._workers.items()}
        self._counters[ENCODERS] = self._encoder_worker.counters
        self._pacer = Pacer(clock.now_ns, clock.monotonic_of, self._guarded_tick)
        self._counts = SampleCounts()
        self._infos: dict[str, CameraInfo] = {}
        self._joints: tuple[str, ...] | None = None
        self._pipeline: PipelineLike | None = None
        self._unused: Counter[str] = Counter()
        self._first_capture_ns: dict[str, int] = {}
        self._last_capture_ns: dict[str, int] = {}
        self._anchor_ns: int | None = None
        self._ended: set[str] = set()
        self._failure: BaseException | None = None
        self._stopping = asyncio.Event()
        self._alarm: Alarm | None = None
        self._garbage = GarbageRounds(time.monotonic_ns)
        self._meter = self._new_meter(0)
        self._health_due_ns = 0
        self._told_status: Status | None = None
        self._drift_watch = DriftWatch()
        self._events = EventTeller(composer, outputs, clock)

    @property
    def anchor_ns(self) -> int | None:
        """Instant 0 of the grid of samples; None until every camera has delivered."""
        return self._anchor_ns

    def stop(self) -> None:
        """End the run; call on the event loop's thread."""
        self._stopping.set()

    async def run(self) -> ServiceSummary:
        """Run until stopped, or until the cameras have ended and every sample they allow is published.

        Raises:
            DeviceError: An input that is not opened again (a recording) broke.
            GhestError: The pipeline cannot be built from what the devices say of themselves.
        """
        loop = asyncio.get_running_loop()
        t_start_ns = self._clock.now_ns()
        self._meter = self._new_meter(t_start_ns)
        self._health_due_ns = t_start_ns + _HEALTH_PERIOD_NS
        self._alarm = self._make_alarm(loop, self._pacer.wake)
        encoder_task = asyncio.create_task(self._encoder_worker.run(), name="encoders")
        try:
            for worker in self._workers.values():
                worker.start(loop)
            self._events.tell(EventKind.STARTED, "info", "service", f"publishing at {self._settings.rate_hz:g} Hz")
            self._pacer.start(Grid(t_start_ns, self._settings.rate_hz), self._alarm)
            await self._stopping.wait()
        finally:
            self._pacer.stop()
            self._alarm.close()
            self._alarm = None
            await self._stop_inputs(encoder_task)
        self._send_health(self._clock.now_ns())
        self._events.tell(EventKind.STOPPED, "info", "service", f"{self._counts.published} samples published")
        if self._failure is not None:
            raise self._failure
        return self.summary()

    def summary(self) -> ServiceSummary:
        """Return what the run has come to so far."""
        return ServiceSummary(
            duration_s=self._counts.duration_s,
            published=self._counts.published,
            valid=self._counts.valid,
            degraded=self._counts.degraded,
            starting=self._counts.starting,
            missed_ticks=self._pacer.missed,
            lateness=lateness(self._pacer),
            inputs=self._counters,
            unused=self._all_unused(),
        )

    # What the workers tell (InputListener).

    def input_event(self, source: str, kind: EventKind, severity: Severity, message: str) -> None:
        """Publish what happened to an input."""
        self._events.tell(kind, severity, source, message)

    def camera_connected(self, name: str, info: CameraInfo) -> None:
        """Note a camera's facts; the pipeline is (re)built once every input is known."""
        self._events.tell(EventKind.INPUT_CONNECTED, "info", name, f"{info.model} {info.serial}")
        known = self._infos.get(name)
        self._infos[name] = info
        if known is not None and not same_camera(known, info):
            self._events.tell(EventKind.INPUT_CHANGED, "warning", name, "the camera came back with another calibration")
            self._drop_pipeline()
        self._prepare()

    def encoders_connected(self, info: EncoderInfo) -> None:
        """Note the joints measured; the pipeline is (re)built once every input is known."""
        self._events.tell(EventKind.INPUT_CONNECTED, "info", ENCODERS, ", ".join(info.joint_names))
        if self._joints is not None and self._joints != info.joint_names:
            self._events.tell(EventKind.INPUT_CHANGED, "warning", ENCODERS, "the link came back with other joints")
            self._drop_pipeline()
        self._joints = info.joint_names
        self._prepare()

    def observed(self, observation: MarkerObservation) -> None:
        """Hand a marker to the pipeline; the grid is anchored at the first instant that every camera has seen."""
        if self._pipeline is None:
            return
        self._add(observation)
        self._last_capture_ns[observation.camera] = observation.t_capture_ns
        if observation.camera not in self._first_capture_ns:
            self._first_capture_ns[observation.camera] = observation.t_capture_ns
            if len(self._first_capture_ns) == len(self._workers):
                self._anchor(max(self._first_capture_ns.values()))

    def encoder_sample(self, sample: EncoderSample) -> None:
        """Hand an encoder sample to the pipeline."""
        self._add(sample)

    def input_ended(self, source: str, error: Exception | None) -> None:
        """Note that an input is through."""
        self._ended.add(source)
        if error is not None:
            self._fail(DeviceError(f"{source}: {error}"))

    # Inside.

    def _observe(self, frame: RgbdFrame) -> MarkerObservation:
        pipeline = self._pipeline
        if pipeline is None:
            raise RuntimeError("the pipeline is being rebuilt")
        return pipeline.observe(frame)

    def _add(self, item: MarkerObservation | EncoderSample) -> None:
        if self._pipeline is not None:
            try:
                self._pipeline.add(item)
            except Exception as error:
                self._fail(error)

    def _all_unused(self) -> Counter[str]:
        return self._unused + Counter(self._pipeline.counts() if self._pipeline is not None else {})

    def _new_meter(self, t_start_ns: int) -> HealthMeter:
        return HealthMeter(
            t_start_ns,
            self._counts,
            self._pacer,
            self._counters,
            vitals=self._vitals,
            unused=self._all_unused,
            garbage=self._garbage,
        )

    def _vitals(self, name: str) -> DeviceVitals:
        return (self._encoder_worker if name == ENCODERS else self._workers[name]).vitals()

    def _drop_pipeline(self) -> None:
        if self._pipeline is not None:
            self._unused.update(self._pipeline.counts())
        self._pipeline = None

    def _prepare(self) -> None:
        if self._pipeline is None:
            if self._joints is None or len(self._infos) < len(self._workers):
                return
            try:
                self._pipeline = self._make_pipeline(dict(self._infos), self._joints)
            except Exception as error:  # told to the user by whoever started the service
                self._fail(error)
                return
        for worker in self._workers.values():
            worker.go()
        self._encoder_worker.go()

    def _anchor(self, t_sample_ns: int) -> None:
        if self._alarm is not None:
            self._anchor_ns = t_sample_ns
            grid = Grid(t_sample_ns + self._settings.lag_ns, self._settings.rate_hz)
            self._pacer.start(grid, self._alarm, first=grid.index_from(self._clock.now_ns()))

    def _guarded_tick(self, k: int, t_tick_ns: int) -> None:
        try:
            self._tick(k, t_tick_ns)
        except Exception as error:
            _log.debug("tick %d failed", k, exc_info=True)
            self._fail(error)

    def _tick(self, k: int, t_tick_ns: int) -> None:
        t_sample_ns = t_tick_ns - self._settings.lag_ns
        # Encoders alone give no angles: what counts is whether frames may still come.
        no_more_frames = self._ended.issuperset(self._workers)
        if no_more_frames and t_sample_ns > max(self._last_capture_ns.values(), default=0):
            self.stop()
            self._pacer.stop()
            return
        if self._pipeline is None or self._anchor_ns is None or t_sample_ns < self._anchor_ns:
            estimate = waiting(t_sample_ns, self._counters, self._last_capture_ns)
        else:
            estimate = self._pipeline.estimate(t_sample_ns)
        estimate = at_the_end(estimate, self._ended, no_more_frames=no_more_frames)
        message = self._composer.compose(estimate, self._clock.now_ns())
        for output in self._outputs:
            output.angles(message, estimate)
        self._counts.add(estimate)
        for marker, kind, text in self._drift_watch.see(t_sample_ns, estimate.drift):
            self._events.tell(kind, "warning" if kind is EventKind.MARKER_DRIFTED else "info", marker, text)
        if t_tick_ns >= self._health_due_ns:
            self._health_due_ns += _HEALTH_PERIOD_NS * (1 + (t_tick_ns - self._health_due_ns) // _HEALTH_PERIOD_NS)
            self._send_health(self._clock.now_ns())
            self._garbage.collect()

    def _send_health(self, t_ns: int) -> None:
        composer = self._composer
        message = self._meter.measure(composer.numbering.take("health"), t_ns, composer.unix_ns(t_ns))
        for output in self._outputs:
            output.health(message)
        if message.status is not self._told_status and message.reason is not Reason.STARTING:
            self._told_status = message.status
            severity: Severity = "warning" if message.status is Status.LOST else "info"
            reason = "" if message.reason is Reason.NONE else f" ({message.reason})"
            self._events.tell(EventKind.STATUS_CHANGED, severity, "service", f"{message.status}{reason}")

    def _fail(self, error: BaseException) -> None:
        if self._failure is None:
            self._failure = error
        self.stop()

    async def _stop_inputs(self, encoder_task: "asyncio.Task[None]") -> None:
        for worker in self._workers.values():
            worker.stop()
        encoder_task.cancel()
        waits = [asyncio.create_task(worker.finished.wait()) for worker in self._workers.values()]
        _, late = await asyncio.wait([encoder_task, *waits], timeout=_STOP_TIMEOUT_S)
        for task in late:
            task.cancel()
        if late:
            _log.warning("a device did not close in %.1f s and is left behind", _STOP_TIMEOUT_S)
            await asyncio.wait(late, timeout=0.1)
