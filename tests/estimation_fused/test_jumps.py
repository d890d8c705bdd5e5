"""Poses far from what was foretold: a marker that has jumped, one that was seen wrong at first, one that was away."""

import math

import numpy as np
import pytest

from ghest_rt.estimation.fused.estimator import FusedEstimator
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, exp_so3
from ghest_rt.messages.results import Status
from tests.estimation_fused.stand import (
    LENGTH_M,
    M1_FROM_ELW,
    Blind,
    Drift,
    Judged,
    Trial,
    estimator_for,
    rms_deg,
    run,
    slide,
    spoilt,
    turn,
)

MIRRORED = transform(exp_so3(np.array([math.radians(30.0), 0.0, 0.0])), np.zeros(3))


def flags(judged: list[Judged], from_s: float = 0.0) -> set[tuple[bool, bool]]:
    reports = [j.estimate.drift for j in judged if j.t_s >= from_s]
    return {(report.m0.flagged, report.m1.flagged) for report in reports if report is not None}


def gh_in_m1(nominal_from_actual: Array) -> Array:
    gh = M1_FROM_ELW[:3, 3] + np.array([0.0, LENGTH_M, 0.0])
    return np.asarray(nominal_from_actual[:3, :3].T @ (gh - nominal_from_actual[:3, 3]))


@pytest.mark.parametrize("at_s", [0.6, 1.0, 1.7, 2.5])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_large_sudden_turn_of_m1_leaves_the_gh_centre_where_it_is_in_it(axis: int, at_s: float) -> None:
    """To first order a turn by 20 degrees would leave it 17 mm away, and that would pass for a slide."""
    turned = turn(axis, 20.0)
    trial = Trial(duration_s=at_s + 0.6, drifts=(Drift("m1", turned, at_s),))
    estimator = estimator_for(trial)
    assert isinstance(estimator, FusedEstimator)
    judged = run(trial, estimator)
    assert estimator.counts() == {"m1_outlier": 3, "m1_jump": 1}
    found = estimator._timeline.newest.gh_in_marker[1]
    assert np.linalg.norm(found - gh_in_m1(turned)) < 1e-3
    last = judged[-1].estimate.drift
    assert last is not None
    assert np.linalg.norm(last.m1.slide_m) < 2e-3
    assert np.allclose(np.degrees(last.m1.turn_rad), 20.0 * np.eye(3)[axis], atol=0.5)
    assert rms_deg(judged, at_s + 0.2) < 0.5


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_the_arm_does_while_m1_is_not_seen_is_no_jump(axis: int) -> None:
    """Half a second without m1, meanwhile 15 degrees that the exoskeleton does not go along with."""

    def beyond(t: float) -> Array:
        share = min(max((t - 1.6) / 0.3, 0.0), 1.0)
        return exp_so3(share * math.radians(15.0) * np.eye(3)[axis])

    trial = Trial(duration_s=3.0, beyond=beyond, blind=(Blind("m1", 1.5, 2.0),))
    estimator = estimator_for(trial)
    judged = run(trial, estimator)
    assert "m1_jump" not in estimator.counts()
    assert flags(judged) == {(False, False)}
    assert rms_deg(judged, 2.25) < 0.25
    assert judged[-1].estimate.status is Status.VALID


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("axis", [0, 2])
@pytest.mark.parametrize("frames", [1, 3])
@pytest.mark.parametrize("marker", ["m0", "m1"])
def test_a_marker_seen_wrong_at_first_does_no_lasting_harm(marker: str, frames: int, axis: int, seed: int) -> None:
    """The mirror solution of its plane, 30 degrees off: what comes after it is right, and no drift."""
    trial = Trial(
        duration_s=1.5, seed=seed, latency_ms=(20.0, 20.0), spoil=spoilt(marker, range(frames), lambda T: T @ turn(axis, 30.0))
    )
    estimator = estimator_for(trial)
    judged = run(trial, estimator)
    assert f"{marker}_jump" not in estimator.counts()
    assert flags(judged, 0.4) == {(False, False)}
    assert rms_deg(judged, 0.4) < 0.3
    assert judged[-1].estimate.status is Status.VALID


def test_a_start_that_was_wrong_is_counted_and_made_anew() -> None:
    trial = Trial(duration_s=0.5, latency_ms=(20.0, 20.0), spoil=spoilt("m1", range(1), lambda T: T @ MIRRORED))
    estimator = estimator_for(trial)
    run(trial, estimator)
    assert estimator.counts() == {"m1_outlier": 3, "m1_mistaken": 1}


@pytest.mark.parametrize("axis", [0, 2])
@pytest.mark.parametrize("marker", ["m0", "m1"])
def test_a_marker_knocked_away_and_put_back_is_no_longer_flagged(marker: str, axis: int) -> None:
    knocked = Drift(marker, slide(axis), 1.0)
    back = Drift(marker, slide(axis, -0.02), 2.0)
    judged = run(Trial(duration_s=3.0, drifts=(knocked, back)))
    away, last = (next(j for j in judged if j.t_s > t_s).estimate.drift for t_s in (1.9, 2.9))
    assert away is not None
    assert last is not None
    assert (away.m0 if marker == "m0" else away.m1).probability > 0.9
    assert max(last.m0.probability, last.m1.probability) < 0.1
    assert flags(judged, 2.5) == {(False, False)}
    assert rms_deg(judged, 2.3) < 0.3
