"""The task that renders a simulated session and finds the markers in it."""

from collections.abc import Sequence

from ghest_rt.studies.engine.task import Result, Task
from ghest_rt.studies.observing.observed import observe
from ghest_rt.studies.observing.packing import pack
from ghest_rt.studies.observing.scenario import Scenario

FRAME_COST = {"paper": 1.0, "sr300": 16.0}
"""How long a frame takes by sensor, in the unit of all costs."""

_SETUP_COST = 30.0


def observe_task(scenario: Scenario, frames: int, *, moved_only: bool = False) -> Task:
    """Return the task that renders a session and keeps what was seen.

    Args:
        scenario: The scenario; of what the estimator is told wrongly nothing is seen.
        frames: Frames of each camera, about, for its cost.
        moved_only: Only what the cameras see whose markers are moved.
    """
    cameras = len(scenario.moved_markers) if moved_only else 2
    return Task.of(
        f"{__name__}:observe_session",
        {"scenario": scenario.as_seen().model_dump(mode="json"), "moved_only": moved_only},
        cost=_SETUP_COST + cameras * frames * FRAME_COST[scenario.sensor],
    )


def observe_session(parameters: dict[str, object], needs: Sequence[Result]) -> Result:
    """Carry out an `observe_task`."""
    scenario = Scenario.model_validate(parameters["scenario"])
    world = scenario.world()
    cameras = [
        name
        for name, camera in world.station.config.cameras.items()
        if camera.marker in scenario.moved_markers or not parameters["moved_only"]
    ]
    return pack(observe(world, scenario.methods, cameras), scenario.sensor)
