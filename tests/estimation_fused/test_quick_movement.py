"""Quick and jerky movement: forecast as well as it can be, and never taken for a marker that has moved."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ghest_rt.geometry.so3 import Array, exp_so3, log_so3
from ghest_rt.messages.results import Reason
from tests.estimation_fused.stand import MS, START, Judged, Trial, comb, estimator_for, pose, rest, rms_deg, run


def any_flag(judged: list[Judged]) -> bool:
    return any(j.estimate.drift.m0.flagged or j.estimate.drift.m1.flagged for j in judged if j.estimate.drift is not None)


def quick_rise(t: float) -> tuple[float, float, float]:
    """A hanging arm that is raised by 70 degrees within 0.6 s, after 2.2 s of stillness; people tremble by 0.2 degrees."""
    share = min(max((t - 2.2) / 0.6, 0.0), 1.0)
    rise = share * share * (3.0 - 2.0 * share)
    tremor = math.radians(0.2) * math.sin(2.0 * math.pi * 9.3 * t) if t > 2.2 else 0.0
    return math.radians(70.0 - 70.0 * rise) + tremor, math.radians(10.0 * rise) - tremor, math.radians(25.0 * rise)


def jerky(seed: int) -> Trial:
    """Recorded movement looks like this: every 10 ms the rate is another one."""
    t = np.arange(-0.5, 6.0, 0.01)
    wander = np.cumsum(math.radians(0.3) * np.random.default_rng(seed).standard_normal((3, len(t))), axis=1)

    def angles(at: float) -> tuple[float, float, float]:
        a, b, g = comb(at)
        da, db, dg = (float(np.interp(at, t, w)) for w in wander)
        return a + da, b + db, g + dg

    return Trial(duration_s=4.0, seed=seed, angles=angles)


def simple_forecasts_deg(trial: Trial, judged: list[Judged]) -> tuple[float, float]:
    """RMS error of keeping the exact truth of the newest frame (30 ms old on average), and of carrying it on straight."""

    def truth(t_ns: int) -> Array:
        return pose(trial.angles, t_ns).gh_from_arm

    kept, carried = [], []
    for j in judged:
        if j.t_s > 0.5:
            t_ns = j.estimate.t_sample_ns
            now, seen, before = truth(t_ns), truth(t_ns - 30 * MS), truth(t_ns - 47 * MS)
            kept.append(log_so3(now @ seen.T))
            carried.append(log_so3(now @ (exp_so3(log_so3(seen @ before.T) * 30.0 / 17.0) @ seen).T))
    rms = [math.degrees(math.sqrt(float(np.mean(np.sum(np.square(errors), axis=1))))) for errors in (kept, carried)]
    return rms[0], rms[1]


def test_a_quick_start_after_stillness_is_not_taken_for_drift() -> None:
    judged = run(Trial(duration_s=4.5, angles=quick_rise))
    assert not any_flag(judged)
    assert all(j.estimate.reason is not Reason.MARKER_DRIFT for j in judged)
    assert rms_deg(judged, 3.0) < 0.15


@pytest.mark.parametrize("seed", [1, 2])
def test_jerky_movement_is_forecast_better_than_by_keeping_or_continuing_the_exact_truth(seed: int) -> None:
    trial = jerky(seed)
    judged = run(trial)
    assert not any_flag(judged)
    assert rms_deg(judged, 0.5) < min(simple_forecasts_deg(trial, judged))


def test_a_bone_that_moves_at_once_with_its_marker_is_movement() -> None:
    """Markers and exoskeleton agree about it: 30 degrees of flexion between two frames, the scapula a sixth of that."""

    def angles(t: float) -> tuple[float, float, float]:
        a, b, g = comb(t)
        return a + math.radians(30.0) * (t > 2.0), b, g

    trial = Trial(duration_s=4.0, angles=angles)
    estimator = estimator_for(trial)
    judged = run(trial, estimator)
    assert "m0_jump" not in estimator.counts()
    assert "m1_jump" not in estimator.counts()
    assert not any_flag(judged)
    assert rms_deg(judged, 2.6) < 0.2


def test_the_elbow_of_a_patient_may_move_beside_that_of_the_exoskeleton() -> None:
    """Its axis is beside the exoskeleton's: seen from the forearm module it wanders as the arm is raised."""
    judged = run(replace(Trial(duration_s=6.0), angles=lambda t: quick_rise(2.0 + 0.2 * t)))
    assert not any_flag(judged)
    assert rms_deg(judged, 0.5) < 0.15


def test_at_rest_nothing_moves() -> None:
    judged = run(Trial(duration_s=2.0, angles=rest))
    found = [j.estimate.gh_from_arm for j in judged if j.t_s > 1.0 and j.estimate.gh_from_arm is not None]
    truth = pose(rest, START).gh_from_arm
    assert max(float(np.linalg.norm(log_so3(R @ truth.T))) for R in found) < math.radians(0.1)
