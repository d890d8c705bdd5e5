"""The joint positions at any instant, a little beyond the newest encoder sample too, and how uncertain they are."""

from collections import deque
from typing import NamedTuple

import numpy as np

from ghest_drivers.samples import EncoderSample
from ghest_rt.estimation.fused.small import inverse_3
from ghest_rt.geometry.so3 import Array
from ghest_rt.sync.encoder_track import EncoderTrack
from ghest_rt.sync.miss import Miss

# Curvature is trusted this far ahead; beyond, the forecast goes straight on.
_CURVED_S = 0.020
# Samples nearer together or farther apart than this give no rate.
_LEAST_STEP_NS = 4_000_000
_MOST_STEP_NS = 60_000_000
# A parabola needs as many samples; the other one is fitted to more, for coarse encoders.
_LEAST_SAMPLES, _FITTED = 3, 7
# Lines: shares of the rate over the last step, and over the last two, that go on. Recorded movement of people is jerky.
_SHARES, _SHARES_OF_TWO = np.array([[0.0], [0.5], [1.0]]), np.array([[0.5], [1.0]])
# Two parabolas and the lines compete; their mean comes last.
_FORECASTS = _MEAN = 2 + len(_SHARES) + len(_SHARES_OF_TWO)
_LINES, _LINES_OF_TWO = slice(2, 2 + len(_SHARES)), slice(2 + len(_SHARES), _FORECASTS)
# Share of the newest sample in what is known of a forecast's errors.
_FOLLOW = 0.04
# Keeps the weights of forecasts without any error finite, rad^2.
_LEAST_SQUARE = 1e-14
# Samples so many steps apart are usual.
_USUAL_STEPS = 1.5
# A joint whose rate is not known may turn by as much, rad/s (m/s for prismatic joints).
_UNKNOWN_RATE = 1.0
# Mean square of the error of a parabola through three samples, carried on by one step, per that of a sample: 20 if samples err
# independently; and movement itself makes more of it than samples do.
_ONE_STEP = 60.0


class Joints(NamedTuple):
    """Joint positions at an instant.

    Attributes:
        positions: (n,) rad (m for prismatic joints), in the order of the encoder link.
        variance: (n,) of them, by resolution and forecast.
        gap_ns: Time between the samples around it, or how far it lies beyond the newest; after a silence the length of that,
            until there are samples enough for a forecast.
        newest_ns: Latch time of the newest sample they rest on.
    """

    positions: Array
    variance: Array
    gap_ns: int
    newest_ns: int


class JointForecast:
    """Interpolates between encoder samples and forecasts from the last few, never farther than asked.

    Seven forecasts compete, joint by joint: two parabolas, and lines that go on with all, half or nothing of the rate. Each
    has a say by how well it has lately foretold samples (weights by the fourth power of the RMS error).
    """

    def __init__(self, encoders: EncoderTrack, max_gap_ns: int) -> None:
        """Start without samples.

        Args:
            encoders: All the samples taken.
            max_gap_ns: The longest gap bridged, between samples or ahead of them.
        """
        self._encoders = encoders
        self._max_gap_ns = max_gap_ns
        self._last: deque[EncoderSample] = deque(maxlen=_FITTED)
        self._step_s = 0.0
        # How long the encoders were silent before samples that do not suffice for a forecast yet.
        self._gap_ns = 0
        # (3, 8, n): position, rate and half the acceleration at the newest sample, of each forecast and of their weighted mean.
        self._forecasts: Array | None = None
        # (8, n): mean squares of the errors of each by one step; None before there are any.
        self._errors: Array | None = None
        # (n,) mean squares of the errors of a sample.
        self._of_sample = np.zeros(0)

    def add(self, sample: EncoderSample) -> None:
        """Note a sample that the track has taken."""
        last = self._last
        step_ns = sample.t_capture_ns - last[-1].t_capture_ns if last else 0
        if last and step_ns < _LEAST_STEP_NS:
            return
        if step_ns > _MOST_STEP_NS:
            last.clear()
            self._gap_ns = step_ns
        elif last:
            step_s = step_ns * 1e-9
            if self._forecasts is not None and step_s <= _USUAL_STEPS * (self._step_s or step_s):
                self._judge(sample, step_s)
            # Rows that are missing make no slower link.
            self._step_s = min(max(step_s, self._step_s / 1.1), 1.1 * self._step_s) if self._step_s else step_s
        last.append(sample)
        self._forecasts = None
        if len(last) >= _LEAST_SAMPLES:
            self._forecasts = _forecasts(last, self._errors)
            self._gap_ns = 0

    def at(self, t_ns: int) -> Joints | None:
        """Return the joints at `t_ns`; None if the encoders say nothing about it."""
        found = self._encoders.at(t_ns, self._max_gap_ns)
        if not isinstance(found, Miss):
            return Joints(found.positions, self._between(found.gap_ns * 1e-9), found.gap_ns, found.newest_ns)
        if found is not Miss.NOT_YET or not self._last:
            return None
        newest_ns = self._last[-1].t_capture_ns
        ahead_ns = t_ns - newest_ns
        if ahead_ns > self._max_gap_ns:
            return None
        gap_ns = max(ahead_ns, self._gap_ns)
        return Joints(self._forecast(ahead_ns * 1e-9), self._ahead(ahead_ns * 1e-9), gap_ns, newest_ns)

    def _forecast(self, ahead_s: float) -> Array:
        if self._forecasts is None:
            last = self._last[-1]
            if len(self._last) < 2:
                return last.angles_rad
            before = self._last[-2]
            slope = (last.angles_rad - before.angles_rad) / (last.t_capture_ns - before.t_capture_ns)
            return np.asarray(last.angles_rad + (ahead_s * 1e9) * slope)
        curved_s = min(ahead_s, _CURVED_S)
        return np.asarray(np.array((1.0, ahead_s, curved_s * (2.0 * ahead_s - curved_s))).dot(self._forecasts[:, _MEAN]))

    def _between(self, gap_s: float) -> Array:
        """Return the variance between two samples: that of a sample, unless some are missing."""
        if gap_s <= _USUAL_STEPS * self._step_s:
            return self._unknown(0.0) if self._errors is None else self._of_sample
        return self._unknown(0.5 * gap_s) if self._errors is None else self._grown(0.5 * gap_s)

    def _ahead(self, ahead_s: float) -> Array:
        """Return the variance of a forecast: it grows from that of a sample, as it has been seen to."""
        return self._unknown(ahead_s) if self._errors is None or self._forecasts is None else self._grown(ahead_s)

    def _grown(self, ahead_s: float) -> Array:
        if self._errors is None:
            return self._of_sample
        reach = ahead_s / self._step_s
        growth = reach * reach if reach < 1.0 else reach**4
        return np.asarray(self._of_sample + growth * self._errors[_MEAN])

    def _unknown(self, ahead_s: float) -> Array:
        size = len(self._last[-1].angles_rad) if self._last else 0
        return np.full(size, (_UNKNOWN_RATE * ahead_s) ** 2) + (0.0 if self._errors is None else self._of_sample)

    def _judge(self, sample: EncoderSample, step_s: float) -> None:
        """Learn from what a new sample shows of the forecasts."""
        if self._forecasts is None:
            return
        of_all = self._forecasts.reshape(3, -1)
        missed = np.array((1.0, step_s, step_s * step_s)).dot(of_all).reshape(_FORECASTS + 1, -1) - sample.angles_rad
        missed *= missed
        if self._errors is None:
            self._errors = missed
        else:
            self._errors += _FOLLOW * (missed - self._errors)
        self._of_sample = self._errors[0] * (1.0 / _ONE_STEP)


def _forecasts(last: deque[EncoderSample], errors: Array | None) -> Array:
    """Return the (3, 8, n) forecasts, with their mean: position, rate, half the acceleration at the newest sample.

    Args:
        last: At least three samples.
        errors: (8, n) mean squares of the errors so far, of which the weights follow; without, the mean is the first forecast.
    """
    newest, before, earlier = last[-1], last[-2], last[-3]
    ago_s, ago_2_s = (before.t_capture_ns - newest.t_capture_ns) * 1e-9, (earlier.t_capture_ns - newest.t_capture_ns) * 1e-9
    rate = (before.angles_rad - newest.angles_rad) / ago_s
    rate_of_two = (earlier.angles_rad - newest.angles_rad) / ago_2_s
    bend = (rate_of_two - rate) / (ago_2_s - ago_s)
    found = np.zeros((3, _FORECASTS + 1, len(bend)))
    found[0] = newest.angles_rad
    found[1, 0], found[2, 0] = rate - ago_s * bend, bend
    found[:, 1] = _parabola(last)
    found[1, _LINES] = _SHARES * rate
    found[1, _LINES_OF_TWO] = _SHARES_OF_TWO * rate_of_two
    if errors is None:
        found[:, _MEAN] = found[:, 0]
    else:
        weights = errors[:_FORECASTS] + _LEAST_SQUARE
        weights *= weights
        np.reciprocal(weights, out=weights)
        weights /= np.add.reduce(weights)
        found[:, _MEAN] = np.add.reduce(weights * found[:, :_FORECASTS], axis=1)
    return found


def _parabola(samples: deque[EncoderSample]) -> Array:
    """Return the (3, n) parabola fitted to all the samples: position, rate, half the acceleration at the newest."""
    newest_ns = samples[-1].t_capture_ns
    # Times in units of the span, so that the normal matrix is well scaled.
    per_span = 1.0 / (samples[0].t_capture_ns - newest_ns)
    A = np.ones((3, len(samples)))
    A[1] = t = np.array([(sample.t_capture_ns - newest_ns) * per_span for sample in samples])
    A[2] = t * t
    found = inverse_3(A.dot(A.T)).dot(A).dot(np.array([sample.angles_rad for sample in samples]))
    per_s = 1e9 * per_span
    return np.asarray(np.array(((1.0,), (per_s,), (per_s * per_s,))) * found)
