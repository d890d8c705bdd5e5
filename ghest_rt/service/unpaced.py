"""A recording through the outputs without a clock: every sample, in order, as fast as the machine allows."""

from collections.abc import Iterable, Sequence

from ghest_rt.messages.results import GhEstimate
from ghest_rt.service.compose import AnglesComposer
from ghest_rt.service.health import SampleCounts
from ghest_rt.service.outputs import Output
from ghest_rt.service.stop_signals import StopSignals


def publish_all(
    estimates: Iterable[GhEstimate], composer: AnglesComposer, lag_ns: int, outputs: Sequence[Output], stop: StopSignals
) -> SampleCounts:
    """Publish estimates one after the other until they end or a signal comes; return what was published.

    Times are the recording's: a sample counts as published `lag_ns` after its instant, so that ages are those of a live run.
    """
    counts = SampleCounts()
    for estimate in estimates:
        if stop.is_set():
            break
        message = composer.compose(estimate, estimate.t_sample_ns + lag_ns)
        for output in outputs:
            output.angles(message, estimate)
        counts.add(estimate)
    return counts
