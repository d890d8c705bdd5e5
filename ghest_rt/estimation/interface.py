"""What every way of estimating offers."""

from typing import Protocol, runtime_checkable

from ghest_drivers.samples import EncoderSample
from ghest_rt.messages.results import GhEstimate, MarkerObservation


@runtime_checkable
class GhEstimator(Protocol):
    """Takes samples as they arrive and says what the GH joint was at an instant. Memory is bounded; one thread at a time."""

    def add_encoder(self, sample: EncoderSample) -> None:
        """Take an encoder sample; one that cannot be used is counted, never an error."""
        ...

    def add_marker(self, observation: MarkerObservation) -> None:
        """Take what became of a marker in a frame, with or without a pose."""
        ...

    def estimate(self, t_ns: int) -> GhEstimate:
        """Return the GH joint at `t_ns`, from what has been added so far.

        An instant that the inputs do not cover gives an estimate without angles that says why, or, from a method that
        forecasts (`fused`), one with a covariance that has grown accordingly, `degraded` as soon as more is missing than
        usual. Nothing old is presented as new.
        """
        ...

    def counts(self) -> dict[str, int]:
        """Return how many samples were not used since the start, by reason."""
        ...
