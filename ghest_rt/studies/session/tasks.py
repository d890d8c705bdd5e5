"""The task that judges a simulated session method by method."""

from collections.abc import Sequence

from ghest_rt.studies.engine.task import Result, Task
from ghest_rt.studies.observing.observed import Observed, with_markers_of
from ghest_rt.studies.observing.packing import unpack
from ghest_rt.studies.observing.scenario import Scenario
from ghest_rt.studies.observing.tasks import observe_task
from ghest_rt.studies.session.errors import pose_error_statistics
from ghest_rt.studies.session.estimating import estimate_session

_ESTIMATE_COST = 0.15


def judge_task(scenario: Scenario, frames: int, base: Task | None = None) -> Task:
    """Return the task that judges every method of a scenario.

    Args:
        scenario: The scenario.
        frames: Frames of each camera, about, for its cost.
        base: The `observe_task` of the undisturbed session; only the cameras whose markers move are rendered then. None
            renders both.
    """
    needs: tuple[Task, ...]
    if base is None:
        needs = (observe_task(scenario, frames),)
    elif scenario.moved_markers:
        needs = (base, observe_task(scenario, frames, moved_only=True))
    else:
        needs = (base,)
    cost = len(scenario.methods) * frames * _ESTIMATE_COST
    return Task.of(f"{__name__}:judge_session", scenario.model_dump(mode="json"), needs=needs, cost=cost)


def judge_session(parameters: dict[str, object], needs: Sequence[Result]) -> Result:
    """Carry out a `judge_task`: the error statistics by method."""
    scenario = Scenario.model_validate(parameters)
    session = _session(needs)
    return Result(
        {
            method: pose_error_statistics(
                estimate_session(
                    session, method, mount_errors=scenario.mount_errors, encoder_bias_rad=scenario.encoder_bias_rad
                ),
                session.truth,
            )
            for method in scenario.methods
        }
    )


def _session(needs: Sequence[Result]) -> Observed:
    first, *others = map(unpack, needs)
    for moved in others:
        first = with_markers_of(first, moved)
    return first
