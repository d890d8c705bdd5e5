"""The tasks of the comparison: a session with ArUco markers, and every contender judged on a session."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, cast

import cv2
import numpy as np

from ghest_rt.estimation.pipeline import lag_ns_of
from ghest_rt.messages.results import MarkerObservation
from ghest_rt.simulation.world import World
from ghest_rt.studies.engine.task import Result, Task
from ghest_rt.studies.observing.observed import Observed, observe
from ghest_rt.studies.observing.packing import unpack
from ghest_rt.studies.observing.scenario import Scenario
from ghest_rt.studies.observing.tasks import FRAME_COST, observe_task
from ghest_rt.studies.rivals.angle_errors import (
    Answers,
    error_statistics,
    girdle_turn_deg,
    on_common_instants,
    simple_forecasts_deg,
)
from ghest_rt.studies.rivals.running import inertial_after_rest_deg, run_without_cameras
from ghest_rt.studies.session.estimating import estimate_session
from ghest_rt.studies.truth import TruthTrack
from ghest_rt.vision.aruco import ArucoDetector

_COMPARE_COST = 4.0
_REFINEMENT = {
    "aruco": cv2.aruco.CORNER_REFINE_NONE,
    "aruco_subpixel": cv2.aruco.CORNER_REFINE_SUBPIX,
}


def compare_task(scenario: Scenario, frames: int) -> Task:
    """Return the task that judges every contender on a session of about `frames` frames of each camera."""
    aruco = Task.of(
        f"{__name__}:answer_with_aruco",
        scenario.model_dump(mode="json"),
        cost=2 * frames * FRAME_COST[scenario.sensor],
    )
    needs = (observe_task(scenario, frames), aruco)
    return Task.of(f"{__name__}:compare_session", scenario.model_dump(mode="json"), needs=needs, cost=_COMPARE_COST * frames)


def answer_with_aruco(parameters: dict[str, object], needs: Sequence[Result]) -> Result:
    """Render the session with ArUco markers; return the rotations found from OpenCV's default corners and from refined ones."""
    scenario = Scenario.model_validate(parameters)
    world = scenario.undisturbed().world(marker="aruco")
    seen = _observe_aruco(world)
    session = observe(world, (), ())
    arrays: dict[str, Any] = {}
    for key, markers in seen.items():
        estimates = estimate_session(replace(session, markers=markers), "aruco")
        arrays[f"{key}_t"] = np.array([e.t_sample_ns for e in estimates])
        arrays[f"{key}_R"] = np.array([np.full((3, 3), np.nan) if e.gh_from_arm is None else e.gh_from_arm for e in estimates])
    return Result({"lag_ns": lag_ns_of(world.station.config, "aruco")}, arrays)


def compare_session(parameters: dict[str, object], needs: Sequence[Result]) -> Result:
    """Judge every contender: its error statistics by key, and what the girdle did."""
    scenario = Scenario.model_validate(parameters)
    session = unpack(needs[0])
    answers = _marker_answers(session, scenario)
    answers.update(_aruco_answers(needs[1]))
    instants_ns = answers["refined"].t_ns
    answers.update(run_without_cameras(session, scenario.sensor, scenario.seed, instants_ns))
    truth = TruthTrack.of(session.truth)
    period_ns = round(1e9 / min(info.rate_hz for info in session.camera_infos.values()))
    return Result(
        {
            "duration_s": (instants_ns[-1] - instants_ns[0]) * 1e-9 if len(instants_ns) else 0.0,
            "girdle_turn_deg": girdle_turn_deg(session.truth),
            **simple_forecasts_deg(truth, instants_ns, period_ns),
            "inertial_after_rest_deg": inertial_after_rest_deg(session, scenario.seed),
            "contenders": {
                key: {
                    **error_statistics(said, truth),
                    **on_common_instants(said, answers["fused"], truth),
                    "lag_ms": said.lag_ns * 1e-6,
                }
                for key, said in answers.items()
            },
        }
    )


def _marker_answers(session: Observed, scenario: Scenario) -> dict[str, Answers]:
    return {
        method: Answers.of(estimate_session(session, method), lag_ns_of(session.station.config, method))
        for method in scenario.methods
    }


def _aruco_answers(result: Result) -> dict[str, Answers]:
    arrays, lag_ns = cast(dict[str, Any], result.arrays), cast(int, result.values["lag_ns"])
    return {
        key: Answers(arrays[f"{key}_t"].tolist(), [None if np.isnan(R[0, 0]) else R for R in arrays[f"{key}_R"]], lag_ns)
        for key in _REFINEMENT
    }


def _observe_aruco(world: World) -> dict[str, dict[tuple[Any, str], list[MarkerObservation]]]:
    """Return the observations by contender and (vision method, camera), every frame rendered once."""
    config = world.station.config
    seen: dict[str, dict[tuple[Any, str], list[MarkerObservation]]] = {key: {} for key in _REFINEMENT}
    for camera in world.camera_names:
        marker = config.cameras[camera].marker
        detectors = {}
        for key, refinement in _REFINEMENT.items():
            parameters = cv2.aruco.DetectorParameters()
            parameters.cornerRefinementMethod = refinement
            detectors[key] = ArucoDetector(camera, marker, config.markers[marker], world.camera_info(camera))
            detectors[key].set_parameters(parameters)
            seen[key]["aruco", camera] = []
        for k in range(world.frame_count(camera)):
            frame = world.frame(camera, k)
            if frame is not None:
                for key, detector in detectors.items():
                    seen[key]["aruco", camera].append(detector.detect(frame))
    return seen
