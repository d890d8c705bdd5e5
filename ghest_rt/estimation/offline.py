"""A recording through the pipeline as fast as the machine allows, with the results the live service would have had."""

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Protocol

from ghest_drivers.samples import EncoderSample, RgbdFrame
from ghest_rt.messages.results import GhEstimate, MarkerObservation, Reason, Status
from ghest_rt.sync.grid import Grid
from ghest_rt.sync.pose_track import EXACT_NS

# Frames in the detectors at a time; enough that neither camera's thread waits for the other's.
_FRAMES_AHEAD = 8
# A silence longer than this is told for so long, then skipped: a jump of the recording's clock must not become a million rows.
_SILENCE_NS = 10_000_000_000
_TAIL_NS = 250_000_000
_CAME_TOO_LATE = (Reason.R0_NO_FRAMES, Reason.R1_NO_FRAMES, Reason.ENCODERS_SILENT, Reason.STARTING)


class OfflinePipeline(Protocol):
    """What an off-line run needs of `ghest_rt.estimation.pipeline.Pipeline`."""

    rate_hz: float
    lag_ns: int

    @property
    def cameras(self) -> tuple[str, ...]:
        """The cameras whose frames are used."""
        ...

    def observe(self, frame: RgbdFrame) -> MarkerObservation:
        """Find the camera's marker in a frame."""
        ...

    def add(self, sample: MarkerObservation | EncoderSample) -> None:
        """Take an observation or an encoder sample."""
        ...

    def estimate(self, t_ns: int) -> GhEstimate:
        """Return the GH joint at an instant."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class _Arrival:
    """One sample on its way to the estimator; a frame's observation may still be in the making."""

    t_arrival_ns: int
    sample: EncoderSample | Future[MarkerObservation]


def estimate_events(
    events: Iterable[object],
    pipeline: OfflinePipeline,
    *,
    rate_hz: float | None = None,
    t_0_ns: int | None = None,
    threads: bool = True,
) -> Iterator[GhEstimate]:
    """Yield the estimates on the absolute grid t_k = t_0 + round(k * 1e9 / rate).

    t_0 is the capture time of the first frame with which both cameras have been seen. An instant t_k is estimated from what had
    arrived by t_k + lag, as it is live; the last ones, up to the last frame, from all there is. If the encoders go on
    alone after that, so does the grid, without angles.

    Args:
        events: `RgbdFrame` and `EncoderSample` in the order of arrival; anything else is passed over.
        pipeline: A pipeline that has not been used yet.
        rate_hz: Instants per second; None for the station's.
        t_0_ns: An instant of the grid to be on instead, that of a live run; instants before the first frames are left out.
        threads: Whether each camera's detector runs in a thread of its own. The results are the same.
    """
    run = _Run(pipeline, pipeline.rate_hz if rate_hz is None else rate_hz, t_0_ns)
    with ExitStack() as stack:
        workers: dict[str, ThreadPoolExecutor] = {}
        if threads:
            for camera in pipeline.cameras:
                workers[camera] = ThreadPoolExecutor(1, thread_name_prefix=f"vision-{camera}")
                stack.callback(workers[camera].shutdown, wait=True, cancel_futures=True)
        queue: deque[_Arrival] = deque()
        frames_ahead = 0
        for event in events:
            if isinstance(event, EncoderSample):
                queue.append(_Arrival(event.t_arrival_ns, event))
            elif isinstance(event, RgbdFrame) and event.info.name in pipeline.cameras:
                queue.append(_Arrival(event.t_arrival_ns, _observe(pipeline, event, workers)))
                frames_ahead += 1
            while queue and (frames_ahead > _FRAMES_AHEAD or isinstance(queue[0].sample, EncoderSample)):
                arrival = queue.popleft()
                frames_ahead -= isinstance(arrival.sample, Future)
                yield from run.take(arrival)
        for arrival in queue:
            yield from run.take(arrival)
        yield from run.finish()


def _observe(pipeline: OfflinePipeline, frame: RgbdFrame, workers: dict[str, ThreadPoolExecutor]) -> Future[MarkerObservation]:
    if workers:
        return workers[frame.info.name].submit(pipeline.observe, frame)
    done: Future[MarkerObservation] = Future()
    done.set_result(pipeline.observe(frame))
    return done


class _Run:
    """The grid of one off-line run."""

    def __init__(self, pipeline: OfflinePipeline, rate_hz: float, t_0_ns: int | None) -> None:
        self._pipeline = pipeline
        self._t_0_ns = t_0_ns
        self._rate_hz = rate_hz
        self._grid: Grid | None = None
        self._k = 0
        self._first_frame_ns: dict[str, int] = {}
        self._last_frame_ns: dict[str, int] = dict.fromkeys(pipeline.cameras, 0)
        self._last_arrival_ns = 0
        self._held: deque[GhEstimate] = deque()

    def take(self, arrival: _Arrival) -> Iterator[GhEstimate]:
        """Yield what is due before a sample arrives, then hand the sample on."""
        self._last_arrival_ns = arrival.t_arrival_ns
        for estimate in self._due(arrival.t_arrival_ns - self._pipeline.lag_ns):
            self._held.append(estimate)
            yield from self._release()
        sample = arrival.sample
        if isinstance(sample, EncoderSample):
            self._pipeline.add(sample)
            return
        observation = sample.result()
        self._pipeline.add(observation)
        self._last_frame_ns[observation.camera] = max(self._last_frame_ns[observation.camera], observation.t_capture_ns)
        yield from self._release()
        if self._grid is None:
            self._first_frame_ns.setdefault(observation.camera, observation.t_capture_ns)
            if len(self._first_frame_ns) == len(self._pipeline.cameras):
                first_ns = max(self._first_frame_ns.values())
                self._grid = Grid(first_ns if self._t_0_ns is None else self._t_0_ns, self._rate_hz)
                self._k = self._grid.index_from(first_ns)

    def finish(self) -> Iterator[GhEstimate]:
        """Yield the instants that remain when everything has arrived."""
        unfinished_ns = self._last_arrival_ns - self._pipeline.lag_ns
        first_end_ns, end_ns = min(self._last_frame_ns.values()), max(self._last_frame_ns.values())
        together = end_ns - first_end_ns < _TAIL_NS  # otherwise a camera was lost before the end
        held = [estimate for estimate in self._held if estimate.t_sample_ns <= end_ns]
        for estimate in (*held, *self._due(end_ns + EXACT_NS + 1)):
            ended = estimate.t_sample_ns >= unfinished_ns or (together and estimate.t_sample_ns > first_end_ns)
            if estimate.status is Status.LOST and ended and estimate.reason in _CAME_TOO_LATE:
                yield replace(estimate, reason=Reason.END_OF_RECORDING)
            else:
                yield estimate

    def _release(self) -> Iterator[GhEstimate]:
        """Yield what was held back while it was open whether another frame would come: as far as that is decided, or all."""
        if self._held and self._held[-1].t_sample_ns - self._held[0].t_sample_ns >= _TAIL_NS:
            yield from self._held
            self._held.clear()
        while self._held and self._decided(self._held[0]):
            yield self._held.popleft()

    def _decided(self, estimate: GhEstimate) -> bool:
        """Say whether an instant is certain to lie before the end, and its reason is not that a camera may have ended."""
        if estimate.reason in _CAME_TOO_LATE:
            return estimate.t_sample_ns <= min(self._last_frame_ns.values())
        return estimate.t_sample_ns <= max(self._last_frame_ns.values())

    def _due(self, before_ns: int) -> Iterator[GhEstimate]:
        """Yield the estimates at the grid instants earlier than `before_ns` that have not been yielded yet."""
        if self._grid is None:
            return
        stop_ns = min(before_ns, self._grid.at(self._k) + _SILENCE_NS)
        while (t_ns := self._grid.at(self._k)) < stop_ns:
            yield self._pipeline.estimate(t_ns)
            self._k += 1
        if stop_ns < before_ns:
            self._k = self._grid.index_from(before_ns)
