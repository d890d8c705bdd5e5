"""The tasks that simulated sessions are made of: observe one, and judge one method by method."""

from collections.abc import Sequence

from ghest_rt.studies.engine.task import Result, Task
from ghest_rt.studies.session.errors import error_statistics
from ghest_rt.studies.session.estimating import estimate_session
from ghest_rt.studies.session.observed import Observed, observe, with_markers_of
from ghest_rt.studies.session.packing import pack, unpack
from ghest_rt.studies.session.scenario import Scenario

_HERE = "ghest_rt.studies.session.tasks"
_FRAME_COST = {"paper": 1.0, "sr300": 16.0}
_ESTIMATE_COST = 0.15
_SETUP_COST = 30.0


def observe_task(scenario: Scenario, frames: int) -> Task:
    """Return the task that renders a session and keeps what was seen; `frames` of each camera, about, for its cost."""
    cost = _SETUP_COST + 2 * frames * _FRAME_COST[scenario.sensor]
    return Task.of(f"{_HERE}:observe_session", scenario.model_dump(mode="json"), cost=cost)


def judge_task(scenario: Scenario, frames: int, base: Task | None = None) -> Task:
    """Return the task that judges every method of a scenario.

    Args:
        scenario: The scenario.
        frames: Frames of each camera, about, for its cost.
        base: The task of the undisturbed session; only the cameras whose markers move are rendered then. None renders both.
    """
    cameras = 2 if base is None else len(scenario.moved_markers)
    cost = cameras * frames * _FRAME_COST[scenario.sensor] + len(scenario.methods) * frames * _ESTIMATE_COST
    needs = () if base is None else (base,)
    parameters = scenario.model_dump(mode="json")
    return Task.of(f"{_HERE}:judge_session", parameters, needs=needs, cost=cost + (_SETUP_COST if cameras else 0.0))


def observe_session(parameters: dict[str, object], needs: Sequence[Result]) -> Result:
    """Carry out an `observe_task`."""
    scenario = Scenario.model_validate(parameters)
    return pack(observe(scenario.world(), scenario.methods), scenario.sensor)


def judge_session(parameters: dict[str, object], needs: Sequence[Result]) -> Result:
    """Carry out a `judge_task`: the error statistics by method."""
    scenario = Scenario.model_validate(parameters)
    session = _session(scenario, needs)
    return Result(
        {
            method: error_statistics(
                estimate_session(
                    session, method, mount_errors=scenario.mount_errors, encoder_bias_rad=scenario.encoder_bias_rad
                ),
                session.truth,
            )
            for method in scenario.methods
        }
    )


def _session(scenario: Scenario, needs: Sequence[Result]) -> Observed:
    if not needs:
        return observe(scenario.world(), scenario.methods)
    base = unpack(needs[0])
    if not scenario.moved_markers:
        return base
    world = scenario.world()
    cameras = [name for name, camera in world.station.config.cameras.items() if camera.marker in scenario.moved_markers]
    return with_markers_of(base, observe(world, scenario.methods, cameras), cameras)
