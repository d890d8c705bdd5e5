"""A busy machine: frames and encoder rows held up on their way, ticks when nothing new has come; nothing wrong is valid."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ghest_drivers.samples import EncoderSample
from ghest_rt.geometry.so3 import log_so3
from ghest_rt.messages.results import MarkerObservation, Status
from tests.estimation_fused.stand import MS, START, Blind, Judged, Trial, estimator_for, events, pose
from tests.estimation_fused.stand import run as stand_run

Sample = MarkerObservation | EncoderSample
Arrivals = list[tuple[int, Sample]]

WRONG_DEG = 1.5  # an angle further off is not the truth of its instant
# Each angle goes to and fro at a constant speed (degrees a second) and turns round within 100 ms: together 1,900 degrees/s^2.
_SPEEDS = ((40.0, 2.1), (60.0, 1.7), (60.0, 1.9))
_TURN_S = 0.1


def abrupt(t: float) -> tuple[float, float, float]:
    a, b, g = (math.radians(_to_and_fro(t + 0.3 * k, *speed)) for k, speed in enumerate(_SPEEDS))
    return a, b, g


def _to_and_fro(t: float, speed: float, period_s: float) -> float:
    """A triangle wave whose corners are parabolas."""
    from_corner_s = (t + period_s / 4.0) % (period_s / 2.0) - period_s / 4.0
    rising = math.floor((t + period_s / 4.0) / (period_s / 2.0)) % 2 == 0
    reach = period_s / 4.0 - _TURN_S / 2.0
    beyond = max(abs(from_corner_s) - reach, 0.0)
    value = speed * (min(abs(from_corner_s), reach) + beyond - beyond * beyond / _TURN_S)
    return math.copysign(value, from_corner_s) * (1.0 if rising else -1.0)


def held_up(arrivals: Arrivals, delay_ms: Callable[[Sample, int], float]) -> Arrivals:
    """The same samples, each late by `delay_ms(sample, arrival)`; none overtakes another of the same device."""
    newest: dict[str, int] = {}
    late: Arrivals = []
    for arrival, sample in arrivals:
        device = "encoders" if isinstance(sample, EncoderSample) else sample.camera
        newest[device] = max(arrival + round(delay_ms(sample, arrival) * MS), newest.get(device, 0))
        late.append((newest[device], replace(sample, t_arrival_ns=newest[device])))
    return sorted(late, key=lambda event: event[0])


def frames(share: float, least_ms: float, most_ms: float) -> Callable[[Sample, int], float]:
    rng = np.random.default_rng(5)
    return lambda sample, _: (
        rng.uniform(least_ms, most_ms) if isinstance(sample, MarkerObservation) and rng.random() < share else 0.0
    )


def rows(share: float, least_ms: float, most_ms: float) -> Callable[[Sample, int], float]:
    rng = np.random.default_rng(6)
    return lambda sample, _: (
        rng.uniform(least_ms, most_ms) if isinstance(sample, EncoderSample) and rng.random() < share else 0.0
    )


def together(*causes: Callable[[Sample, int], float]) -> Callable[[Sample, int], float]:
    return lambda sample, arrival: sum(cause(sample, arrival) for cause in causes)


def stalls(every_ms: int, for_ms: int) -> Callable[[Sample, int], float]:
    """Nothing is taken in for a while, again and again; everything at once after that."""
    return lambda _, arrival: max(for_ms - ((arrival - START) // MS) % every_ms, 0)


def run(delay_ms: Callable[[Sample, int], float]) -> list[Judged]:
    trial = Trial(duration_s=8.0, angles=abrupt)
    estimator = estimator_for(trial)
    waiting = held_up(events(trial), delay_ms)
    judged, taken = [], 0
    for k in range(round((trial.duration_s - 0.1) * 66.6)):
        t = START + round(k * 1e9 / 66.6)
        while waiting[taken][0] <= t:
            sample = waiting[taken][1]
            if isinstance(sample, EncoderSample):
                estimator.add_encoder(sample)
            else:
                estimator.add_marker(sample)
            taken += 1
        found = estimator.estimate(t)
        truth = pose(trial.angles, t).gh_from_arm
        error = None if found.gh_from_arm is None else log_so3(truth @ found.gh_from_arm.T)
        judged.append(Judged((t - START) * 1e-9, found, error))
    return [one for one in judged if one.t_s > 0.7]


def valid(judged: list[Judged]) -> list[Judged]:
    return [one for one in judged if one.estimate.status is Status.VALID]


def test_on_a_machine_at_rest_the_abrupt_movement_is_valid_throughout() -> None:
    judged = run(lambda *_: 0.0)
    assert len(valid(judged)) == len(judged)
    assert max(one.error_deg for one in judged) < 1.0


@pytest.mark.parametrize(
    "delay_ms",
    [
        pytest.param(frames(0.1, 20.0, 60.0), id="a frame now and then"),
        pytest.param(frames(0.9, 30.0, 60.0), id="nearly all frames"),
        pytest.param(frames(0.9, 60.0, 120.0), id="nearly all frames, much"),
        pytest.param(rows(0.3, 20.0, 40.0), id="encoder rows now and then"),
        pytest.param(rows(0.5, 30.0, 90.0), id="every other encoder row, much"),
        pytest.param(together(frames(0.5, 20.0, 80.0), rows(0.5, 10.0, 35.0)), id="all inputs"),
        pytest.param(stalls(400, 90), id="everything at once after a pause"),
    ],
)
def test_whatever_is_held_up_nothing_wrong_is_called_valid(delay_ms: Callable[[Sample, int], float]) -> None:
    judged = run(delay_ms)
    assert max((one.error_deg for one in valid(judged)), default=0.0) < WRONG_DEG
    told = [one for one in judged if one.estimate.status is Status.DEGRADED]
    assert told, "nothing was held up"
    # Angles go on: told apart, not withheld.
    assert sum(one.error_rad is not None for one in judged) > 0.9 * len(judged)


def test_frames_that_always_come_late_do_not_become_the_usual() -> None:
    """After a minute of 100 ms the camera's latency would be 100 ms, and a forecast over 130 ms as good as any."""
    judged = run(lambda sample, _: 0.0 if isinstance(sample, EncoderSample) else 80.0)
    assert valid(judged) == []
    assert all(one.error_rad is not None for one in judged)


def test_valid_samples_hold_what_their_sigma_promises() -> None:
    judged = valid(run(together(frames(0.2, 10.0, 60.0), rows(0.2, 5.0, 30.0))))
    assert len(judged) > 100
    ratios = np.array([one.error_deg / one.sigma_deg for one in judged])
    assert np.mean(ratios < 2.0) > 0.93
    assert ratios.max() < 5.0


@pytest.mark.parametrize("marker", ["m0", "m1"])
def test_the_first_sightings_after_an_outage_are_not_valid_yet(marker: str) -> None:
    """One sighting tells where a marker is, not how fast it moves."""
    trial = Trial(duration_s=4.0, angles=abrupt, blind=(Blind(marker, 1.5, 2.5, frames=False),))
    judged = [one for one in stand_run(trial) if one.t_s > 2.4]
    first = valid(judged)[0]
    assert 2.5 + 0.02 + 2.0 / trial.rate_hz < first.t_s < 2.7
    assert max(one.error_deg for one in valid(judged)) < WRONG_DEG
