"""Rows that the encoders lose in a movement: the joints are less certain meanwhile, and the samples say so."""

import math

import numpy as np
import pytest

from ghest_drivers.samples import EncoderSample
from ghest_rt.estimation.fused.estimator import FusedEstimator
from ghest_rt.estimation.fused.joints import JointForecast
from ghest_rt.messages.results import Status
from ghest_rt.sync.encoder_track import EncoderTrack
from tests.estimation_fused.stand import MS, START, Trial, estimator_for, events, run

# Farther beyond the newest row than this a forecast is no normal one any more; after a silence of more than 60 ms there is
# none before the third row.
OVERDUE_NS, SILENCE_NS, WANTED_ROWS = 32 * MS, 60 * MS, 3
RATES = pytest.mark.parametrize("step_ms", [15.0, 10.0], ids=["66 Hz", "100 Hz"])


def swing(t_ns: int) -> float:
    return 0.8 * math.sin(2.0 * math.pi * 0.5 * t_ns * 1e-9)


class Link:
    """One joint that swings; the rows are exact to their resolution."""

    def __init__(self, step_ms: float) -> None:
        self.step_ns = round(step_ms * MS)
        self.track = EncoderTrack(np.array([[-9.0, 9.0]]))
        self.forecast = JointForecast(self.track, 100 * MS)

    def row(self, k: float) -> int:
        t_ns = START + round(k * self.step_ns)
        resolution = 2.0 * math.pi / 2**14
        sample = EncoderSample(round(10 * k), np.array([round(swing(t_ns) / resolution) * resolution]), t_ns, t_ns, t_ns)
        assert self.track.add(sample) is None
        self.forecast.add(sample)
        return t_ns

    def at(self, t_ns: int) -> tuple[float, float]:
        """Standard deviation and error of the joint at an instant."""
        found = self.forecast.at(t_ns)
        assert found is not None
        return math.sqrt(float(found.variance[0])), abs(float(found.positions[0]) - swing(t_ns))


@RATES
def test_the_joints_variance_grows_while_rows_are_missing(step_ms: float) -> None:
    link = Link(step_ms)
    for k in range(60):
        newest_ns = link.row(k)
    sigmas, errors = zip(*(link.at(newest_ns + ahead * MS) for ahead in range(0, 80, 5)), strict=True)
    assert np.all(np.diff(sigmas) > 0.0)
    assert sigmas[-1] > 10.0 * sigmas[3]
    assert np.all(np.array(errors) < 3.0 * np.array(sigmas))


@RATES
@pytest.mark.parametrize("back", [1, 2, 5])
def test_between_rows_with_four_missing_the_joints_are_less_certain(step_ms: float, back: int) -> None:
    link = Link(step_ms)
    for k in (*range(60), *range(64, 64 + back)):
        link.row(k)
    usual, _ = link.at(START + round(50.5 * link.step_ns))
    missing, error = link.at(START + round(61.5 * link.step_ns))
    assert missing > 3.0 * usual
    assert error < 3.0 * missing


@RATES
def test_one_row_that_comes_early_makes_the_others_no_gaps(step_ms: float) -> None:
    link = Link(step_ms)
    for k in (*range(60), 60.4, *range(61, 64)):
        newest_ns = link.row(k)
    usual, _ = link.at(START + round(50.5 * link.step_ns))
    after, _ = link.at(START + round(62.5 * link.step_ns))
    ahead, _ = link.at(newest_ns + link.step_ns)
    assert after < 1.5 * usual
    assert ahead < 20.0 * usual


@RATES
def test_no_sample_is_valid_before_the_joints_can_be_forecast_again(step_ms: float) -> None:
    trial = Trial(duration_s=2.0, encoder_step_ms=step_ms, lost_rows=range(round(1_600 / step_ms), round(1_600 / step_ms) + 4))
    rows = [(t, sample.t_capture_ns) for t, sample in events(trial) if isinstance(sample, EncoderSample)]
    told = []
    for j in run(trial):
        t_ns = j.estimate.t_sample_ns
        came = [capture_ns for arrival_ns, capture_ns in rows if arrival_ns <= t_ns]
        steps = np.diff(came[-WANTED_ROWS:])
        forecast = t_ns - came[-1] <= OVERDUE_NS and steps.max() <= SILENCE_NS
        if j.t_s > 1.0:
            told.append((forecast, j.estimate.status is Status.VALID))
    assert set(told) == {(True, True), (False, False)}


@RATES
def test_sightings_while_rows_are_missing_count_for_less(step_ms: float) -> None:
    """Only those of m1: camera r0 stands still."""
    first = round(1_600 / step_ms)
    trial = Trial(duration_s=2.0, encoder_step_ms=step_ms, lost_rows=range(first, first + 4))
    rows = [sample.t_capture_ns for _, sample in events(trial) if isinstance(sample, EncoderSample)]
    before_ns = max(t_ns for t_ns in rows if t_ns < START + round(first * step_ms - 100 + 0.5 * step_ms) * MS)
    estimator = estimator_for(trial)
    assert isinstance(estimator, FusedEstimator)
    usual: dict[int, list[float]] = {0: [], 1: []}
    missing: dict[int, list[float]] = {0: [], 1: []}
    for t_ns, sample in events(trial):
        if isinstance(sample, EncoderSample):
            estimator.add_encoder(sample)
            continue
        estimator.add_marker(sample)
        last = estimator._last[sample.camera == "r1"]
        if t_ns < START + 1_000 * MS or last is None or last.t_ns != sample.t_capture_ns:
            continue
        inside = 15 * MS < sample.t_capture_ns - before_ns < 4 * step_ms * MS
        (missing if inside else usual)[last.marker].append(float(np.trace(last.covariance[3:, 3:])))
    assert len(missing[1]) >= 1
    assert min(missing[1]) > 2.0 * np.median(usual[1])
    assert np.allclose(missing[0], np.median(usual[0]))


def test_frames_that_the_encoders_do_not_cover_are_counted() -> None:
    """Silence of 0.3 s, 0.1 s of which are forecast: twelve frames of each camera come too early or too late for that."""
    trial = Trial(duration_s=2.0, lost_rows=range(80, 100))
    estimator = estimator_for(trial)
    judged = run(trial, estimator)
    counts = estimator.counts()
    assert counts.keys() == {"m0_without_joints", "m1_without_joints"}
    assert all(8 <= n <= 14 for n in counts.values())
    assert judged[-1].estimate.status is Status.VALID
