"""What the service is given and what it comes to."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from ghest_drivers.samples import CameraInfo, EncoderSample, RgbdFrame
from ghest_rt.messages.published import Lateness
from ghest_rt.messages.results import GhEstimate, MarkerObservation
from ghest_rt.service.inputs import InputCounters, InputSettings


class PipelineLike(Protocol):
    """From frames and encoder samples to estimates (`ghest_rt.estimation.pipeline.Pipeline`)."""

    def observe(self, frame: RgbdFrame) -> MarkerObservation:
        """Find the marker in a frame; called on that camera's thread."""
        ...

    def add(self, item: MarkerObservation | EncoderSample) -> None:
        """Take in a result of `observe` or an encoder sample; called on the loop's thread."""
        ...

    def estimate(self, t_ns: int) -> GhEstimate:
        """Return the joint at `t_ns`; called on the loop's thread."""
        ...

    def counts(self) -> dict[str, int]:
        """Return how many samples were not used since the start, by reason; called on the loop's thread."""
        ...


MakePipeline = Callable[[dict[str, CameraInfo], tuple[str, ...]], PipelineLike]


@dataclass(frozen=True, slots=True)
class ServiceSettings:
    """What the service needs to know of the station.

    Attributes:
        rate_hz: Grid rate.
        lag_ns: A sample is published this long after the instant it holds for.
        inputs: How devices are watched.
    """

    rate_hz: float
    lag_ns: int
    inputs: InputSettings = field(default_factory=InputSettings)


@dataclass(frozen=True, slots=True)
class ServiceSummary:
    """What a run of the service came to.

    Attributes:
        duration_s: From the instant of the first sample after the start to that of the last one, on the service's clock.
        published: Samples published.
        valid: Of these with status valid.
        degraded: Of these with status degraded.
        starting: Of these before every input had arrived.
        missed_ticks: Grid slots skipped.
        lateness: How late the ticks came.
        inputs: Counters of every input.
        unused: Samples that arrived whole but were not used (repeated, out of order, implausible…), by reason.
    """

    duration_s: float
    published: int
    valid: int
    degraded: int
    starting: int
    missed_ticks: int
    lateness: Lateness
    inputs: Mapping[str, InputCounters]
    unused: Mapping[str, int]
