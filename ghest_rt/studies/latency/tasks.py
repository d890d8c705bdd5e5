"""The tasks of the latency study: one movement, played faster or slower, judged at the instants of publishing."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.pipeline import lag_ns_of
from ghest_rt.geometry.so3 import angle_between_rad
from ghest_rt.messages.results import GhEstimate
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.posture import Motion, Posture
from ghest_rt.simulation.sensors import find_sensors
from ghest_rt.simulation.world import World
from ghest_rt.studies.engine.task import Result, Task
from ghest_rt.studies.observing.observed import Observed, observe
from ghest_rt.studies.observing.scenario import HEIGHT_M, Scenario
from ghest_rt.studies.observing.tasks import FRAME_COST
from ghest_rt.studies.rivals.angle_errors import Answers, error_columns
from ghest_rt.studies.session.estimating import estimate_session
from ghest_rt.studies.truth import TruthTrack
from ghest_rt.vision.station import Method

_MARGIN_S = 0.5  # of the movement, left out at both ends: movements answer only a little beyond them
_HALF_STEP_NS = 5_000_000

CANDIDATES: dict[str, tuple[Method, bool]] = {
    "paper": ("paper", False),
    "paper_at_once": ("paper", True),
    "refined": ("refined", False),
    "fused": ("fused", False),
}
"""By key: the method, and whether it is made to answer without the station's lag."""


@dataclass(frozen=True, slots=True)
class PlayedAt:
    """A movement at another speed, from half a second after its start on.

    Attributes:
        motion: The movement.
        factor: 2 plays it twice as fast.
        span_s: How much of it, in its own time.
    """

    motion: Motion
    factor: float
    span_s: float

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{self.motion.name} x{self.factor:g}"

    @property
    def duration_s(self) -> float:
        """How long playing it takes."""
        return self.span_s / self.factor

    def at(self, t_s: float) -> Posture:
        """Return the posture."""
        return self.motion.at(_MARGIN_S + self.factor * t_s)


def latency_task(scenario: Scenario, factor: float, span_s: float) -> Task:
    """Return the task that judges every candidate on a movement played at a speed; `span_s` of it at most."""
    cost = 2 * 66.6 * span_s / factor * FRAME_COST[scenario.sensor]
    parameters = {"scenario": scenario.model_dump(mode="json"), "factor": factor, "span_s": span_s}
    return Task.of(f"{__name__}:judge_speed", parameters, cost=cost)


def judge_speed(parameters: dict[str, object], needs: Sequence[Result]) -> Result:
    """Carry out a `latency_task`: by candidate its lag, the ages of its inputs, and speed and error of every sample."""
    scenario = Scenario.model_validate(parameters["scenario"])
    session = observe(
        _world(scenario, float(str(parameters["factor"])), float(str(parameters["span_s"]))),
        {method for method, _ in CANDIDATES.values()},
    )
    truth = TruthTrack.of(session.truth)
    return Result({key: _judge(session, truth, method, at_once) for key, (method, at_once) in CANDIDATES.items()})


def _judge(session: Observed, truth: TruthTrack, method: Method, at_once: bool) -> dict[str, object]:
    if at_once:
        session = replace(session, station=_without_lag(session.station))
    lag_ns = lag_ns_of(session.station.config, method)
    estimates = estimate_session(session, method)
    columns = error_columns(Answers.of(estimates, lag_ns), truth)
    speeds = [_speed_dps(truth, estimate.t_sample_ns + lag_ns) for estimate in estimates]
    known = [
        (speed, error)
        for speed, error in zip(speeds, columns["published_deg"].tolist(), strict=True)
        if math.isfinite(speed) and math.isfinite(error)
    ]
    own = columns["orientation_deg"]
    own = own[np.isfinite(own)]
    return {
        "lag_ms": lag_ns * 1e-6,
        "own_instant_deg": float(np.sqrt(np.mean(np.square(own)))) if own.size else None,
        "age_ms": {name: _age_ms(estimates, name, lag_ns) for name in ("r0", "r1", "encoders")},
        "speed_dps": [round(speed, 3) for speed, _ in known],
        "published_deg": [round(error, 5) for _, error in known],
    }


def _age_ms(estimates: Sequence[GhEstimate], name: str, lag_ns: int) -> float | None:
    """Return the median age of an input's newest sample when the answer that rests on it is published."""
    ages = [e.t_sample_ns + lag_ns - e.newest_ns[name] for e in estimates if e.gh_from_arm is not None and name in e.newest_ns]
    return median(ages) * 1e-6 if ages else None


def _speed_dps(truth: TruthTrack, t_ns: int) -> float:
    """Return how fast the GH joint turns, degrees a second; NaN outside the truth."""
    before, after = truth.at(t_ns - _HALF_STEP_NS), truth.at(t_ns + _HALF_STEP_NS)
    if before is None or after is None:
        return math.nan
    return math.degrees(angle_between_rad(after.gh_from_arm, before.gh_from_arm)) / (2 * _HALF_STEP_NS * 1e-9)


def _without_lag(station: LoadedStation) -> LoadedStation:
    estimator = station.config.estimator.model_copy(update={"lag_ms": 0.0})
    return replace(station, config=station.config.model_copy(update={"estimator": estimator}))


def _world(scenario: Scenario, factor: float, span_s: float) -> World:
    motion = scenario.performed()
    span_s = min(span_s, motion.duration_s - 2 * _MARGIN_S)
    if not span_s > 0:
        raise BadInputError(f"{scenario.name}: {motion.duration_s:g} s are too short to be played at other speeds")
    # The station fitted to the patient is that of the scenario's own clinic.
    station = scenario.model_copy(update={"duration_s": 0.05}).world().station
    return World(
        station,
        anatomy(HEIGHT_M),
        PlayedAt(motion, factor, span_s),
        find_sensors(scenario.sensor),
        seed=scenario.seed,
    )
