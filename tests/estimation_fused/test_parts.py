"""The filter's equations against numerical differentiation, and its book-keeping."""

import math

import numpy as np
import pytest

from ghest_drivers.samples import EncoderSample
from ghest_rt.estimation.fused.belief import BOTH_GH, GH, GH_RATE, SIZE, Belief
from ghest_rt.estimation.fused.joints import JointForecast
from ghest_rt.estimation.fused.measurement import innovation_of
from ghest_rt.estimation.fused.process import Process
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, exp_so3, log_so3
from ghest_rt.sync.encoder_track import EncoderTrack
from tests.estimation_fused.stand import MS, START, Trial, estimator_for, events, run

STEP = 1e-6
ELBOW = np.array([0.0, -0.045, -0.055])


def random_belief(rng: np.random.Generator) -> Belief:
    return Belief(
        t_ns=START,
        e_from_r1=transform(exp_so3(rng.normal(size=3)), rng.normal(size=3)),
        e_from_marker=(exp_so3(rng.normal(size=3)), exp_so3(rng.normal(size=3))),
        p_gh=rng.normal(size=3),
        rates=0.3 * rng.normal(size=9),
        gh_in_marker=(0.1 * rng.normal(size=3), np.array([0.0, 0.28, -0.05]) + 0.02 * rng.normal(size=3)),
        P=1e-4 * np.eye(SIZE),
        agility=(1.0, 1.0),
        seen_ns=(START, START),
    )


def shifted(belief: Belief, index: int, step: float) -> Belief:
    error = np.zeros(SIZE)
    error[index] = step
    moved = belief.copy()
    moved.shift(error)
    return moved


def error_between(estimate: Belief, true: Belief) -> Array:
    """The (24,) error that takes `estimate` to `true`."""
    turns = [log_so3(a @ b.T) for a, b in zip(true.e_from_marker, estimate.e_from_marker, strict=True)]
    in_marker = [a - b for a, b in zip(true.gh_in_marker, estimate.gh_in_marker, strict=True)]
    return np.concatenate((turns[0], true.p_gh - estimate.p_gh, turns[1], *in_marker, true.rates - estimate.rates))


@pytest.mark.parametrize("marker", [0, 1])
def test_the_measurement_jacobian_is_the_derivative(marker: int) -> None:
    rng = np.random.default_rng(marker)
    belief = random_belief(rng)
    seen = belief.e_from(marker)
    H = innovation_of(belief, marker, seen).H
    assert np.allclose(innovation_of(belief, marker, seen).residual, 0.0, atol=1e-12)
    for index in range(SIZE):
        true = shifted(belief, index, STEP)
        assert np.allclose(innovation_of(belief, marker, true.e_from(marker)).residual / STEP, H[:, index], atol=1e-5)


def noiseless() -> Process:
    return Process(Tuning(rotation_density=0.0, position_density=0.0, creep_m2_s=(0.0, 0.0)), ELBOW)


def anisotropic(rng: np.random.Generator, sigma: Array) -> Array:
    """A covariance with these standard deviations that correlates everything with everything."""
    A = rng.normal(size=(SIZE, 2 * SIZE))
    P = A @ A.T
    scale = sigma / np.sqrt(np.diag(P))
    return np.asarray(P * np.outer(scale, scale))


def derivative(process: Process, belief: Belief, t_ns: int, e_from_r1: Array) -> Array:
    """The (24, 24) derivative of the error after a step with respect to that before it, by central differences."""
    ends = []
    for step in (STEP, -STEP):
        columns = []
        for index in range(SIZE):
            end, neighbour = belief.copy(), shifted(belief, index, step)
            process.advance(end, t_ns, e_from_r1)
            process.advance(neighbour, t_ns, e_from_r1)
            columns.append(error_between(end, neighbour))
        ends.append(np.column_stack(columns))
    return np.asarray((ends[0] - ends[1]) / (2.0 * STEP))


def correlated(P: Array, sigma: Array) -> Array:
    return np.asarray(P / np.outer(sigma, sigma))


def test_the_covariance_moves_as_neighbouring_beliefs_do() -> None:
    """Half a second of slow movement: what the rates do to the poses; the terms left out are as small as the movement."""
    rng = np.random.default_rng(3)
    belief = random_belief(rng)
    belief.rates = 2e-3 * rng.normal(size=9)
    sigma = np.ones(SIZE)
    sigma[GH] = sigma[BOTH_GH] = sigma[GH_RATE] = 0.3
    belief.P = 1e-4 * anisotropic(rng, sigma)
    small = transform(exp_so3(np.array([1e-3, -2e-3, 1e-3])), np.array([4e-4, 2e-4, -3e-4]))
    end = belief.copy()
    noiseless().advance(end, START + 500 * MS, small @ belief.e_from_r1)
    F = derivative(noiseless(), belief, START + 500 * MS, small @ belief.e_from_r1)
    told, true = end.P, F @ belief.P @ F.T
    spread = np.sqrt(np.diag(true))
    assert np.allclose(correlated(told, spread), correlated(true, spread), atol=0.02)


def test_the_covariance_of_the_arm_turns_with_the_exoskeleton() -> None:
    """A large turn about the GH centre, whose own place is known: then nothing is left out."""
    rng = np.random.default_rng(4)
    belief = random_belief(rng)
    belief.rates = np.zeros(9)
    sigma = 0.01 * rng.uniform(0.3, 3.0, size=SIZE)
    belief.P = anisotropic(rng, sigma)
    for known in (GH, GH_RATE):
        belief.P[known] = belief.P[:, known] = 0.0
    turn = exp_so3(np.array([0.3, -0.4, 0.5]))
    about = transform(turn, belief.p_gh - turn @ belief.p_gh)
    end = belief.copy()
    noiseless().advance(end, START + 300 * MS, about @ belief.e_from_r1)
    F = derivative(noiseless(), belief, START + 300 * MS, about @ belief.e_from_r1)
    assert np.allclose(correlated(end.P, sigma), correlated(F @ belief.P @ F.T, sigma), atol=1e-5)
    assert not np.allclose(correlated(end.P, sigma), correlated(belief.P, sigma), atol=0.1)


def test_the_arm_follows_the_exoskeleton_that_carries_it() -> None:
    """If everything turns with camera r1 about the GH centre, so does m1, by as much, however far."""
    rng = np.random.default_rng(4)
    belief = random_belief(rng)
    belief.rates = np.zeros(9)
    turn = exp_so3(np.array([0.3, -0.4, 0.5]))
    about = transform(turn, belief.p_gh - turn @ belief.p_gh)
    moved = belief.copy()
    Process(Tuning(), ELBOW).advance(moved, START + 300 * MS, about @ belief.e_from_r1)
    assert np.allclose(moved.e_from_marker[1], turn @ belief.e_from_marker[1], atol=1e-9)


def test_joints_are_forecast_along_a_parabola_and_not_for_long() -> None:
    limits = np.array([[-9.0, 9.0]])
    track = EncoderTrack(limits)
    forecast = JointForecast(track, 100 * MS)
    times_ms = (0, 15, 31)
    for k, ms in enumerate(times_ms):
        t = ms * 1e-3
        sample = EncoderSample(k, np.array([0.2 + 1.5 * t - 2.0 * t * t]), ms * MS, ms * MS, ms * MS)
        assert track.add(sample) is None
        forecast.add(sample)
    found = forecast.at(45 * MS)
    assert found is not None
    assert found.gap_ns == 14 * MS
    assert math.isclose(float(found.positions[0]), 0.2 + 1.5 * 0.045 - 2.0 * 0.045**2, abs_tol=1e-12)
    assert forecast.at(132 * MS) is None
    between = forecast.at(23 * MS)
    assert between is not None


def test_the_same_samples_give_the_same_estimates_to_the_last_bit() -> None:
    trial = Trial(duration_s=2.0)
    for a, b in zip(run(trial), run(trial), strict=True):
        assert (a.estimate.gh_from_arm is None) == (b.estimate.gh_from_arm is None)
        if a.estimate.gh_from_arm is not None:
            assert np.array_equal(a.estimate.gh_from_arm, b.estimate.gh_from_arm)
            assert np.array_equal(a.estimate.covariance, b.estimate.covariance)


def test_late_frames_count_as_if_they_had_come_in_time() -> None:
    """All frames of r0 but the first held up by 60 ms: once they are in, what is believed is the same."""
    trial = Trial(duration_s=2.0, latency_ms=(20.0, 20.0))
    in_time, late = estimator_for(trial), estimator_for(trial)
    held = [
        (t + (60 * MS if getattr(sample, "camera", "") == "r0" and sample.seq else 0), sample) for t, sample in events(trial)
    ]
    for estimator, order in ((in_time, events(trial)), (late, sorted(held, key=lambda event: event[0]))):
        for _, sample in order:
            if isinstance(sample, EncoderSample):
                estimator.add_encoder(sample)
            else:
                estimator.add_marker(sample)
    t_ns = START + 1_980 * MS
    a, b = in_time.estimate(t_ns), late.estimate(t_ns)
    assert a.gh_from_arm is not None
    assert b.gh_from_arm is not None
    assert np.allclose(a.gh_from_arm, b.gh_from_arm, atol=5e-4)
    assert not late.counts()
