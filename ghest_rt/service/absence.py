"""What is published while there is nothing to estimate from: no angles, and the reason."""

from collections.abc import Container, Mapping
from dataclasses import replace

from ghest_rt.messages.published import InputState
from ghest_rt.messages.results import GhEstimate, Reason, Status
from ghest_rt.service.encoder_worker import ENCODERS
from ghest_rt.service.inputs import InputCounters

_ABSENT = ((ENCODERS, Reason.ENCODERS_SILENT), ("r0", Reason.R0_NO_FRAMES), ("r1", Reason.R1_NO_FRAMES))
_CAME_TOO_LATE = {Reason.R0_NO_FRAMES: "r0", Reason.R1_NO_FRAMES: "r1", Reason.ENCODERS_SILENT: None}


def waiting(t_sample_ns: int, inputs: Mapping[str, InputCounters], newest_ns: Mapping[str, int]) -> GhEstimate:
    """Return the estimate until every camera has delivered: none, and which input is waited for.

    Args:
        t_sample_ns: The instant.
        inputs: Counters of the cameras and of the encoders.
        newest_ns: Capture time of the newest frame of each camera that has delivered.
    """
    absent = (reason for name, reason in _ABSENT if inputs[name].state in (InputState.LOST, InputState.SILENT))
    reason = next(absent, Reason.STARTING)
    return GhEstimate(t_sample_ns, Status.LOST, reason, None, None, None, None, None, dict(newest_ns))


def at_the_end(estimate: GhEstimate, ended: Container[str], *, no_more_frames: bool) -> GhEstimate:
    """Return an estimate that lacks an input which is through with the end of the recording as its reason.

    Args:
        estimate: As it came.
        ended: The inputs that are through.
        no_more_frames: Whether all cameras are.
    """
    if estimate.reason in _CAME_TOO_LATE and (no_more_frames or _CAME_TOO_LATE[estimate.reason] in ended):
        return replace(estimate, reason=Reason.END_OF_RECORDING)
    return estimate
