"""The joint positions at any instant, a little beyond the newest encoder sample too."""

from collections import deque
from dataclasses import dataclass

from ghest_drivers.samples import EncoderSample
from ghest_rt.geometry.so3 import Array
from ghest_rt.sync.encoder_track import EncoderTrack
from ghest_rt.sync.miss import Miss

# Curvature is trusted this far ahead; beyond, the forecast goes straight on.
_CURVED_NS = 20_000_000
# Samples nearer together or farther apart than this give no rate.
_LEAST_STEP_NS = 4_000_000
_MOST_STEP_NS = 60_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Joints:
    """Joint positions at an instant.

    Attributes:
        positions: (n,) rad (m for prismatic joints), in the order of the encoder link.
        ahead_ns: How far the instant lies beyond the newest sample; 0 where samples lie around it.
        gap_ns: Time between the samples around it, or `ahead_ns`.
        newest_ns: Latch time of the newest sample they rest on.
    """

    positions: Array
    ahead_ns: int
    gap_ns: int
    newest_ns: int


class JointForecast:
    """Interpolates between encoder samples and forecasts from the last three, never farther than asked."""

    def __init__(self, encoders: EncoderTrack, max_gap_ns: int) -> None:
        """Start without samples.

        Args:
            encoders: All the samples taken.
            max_gap_ns: The longest gap bridged, between samples or ahead of them.
        """
        self._encoders = encoders
        self._max_gap_ns = max_gap_ns
        self._last: deque[EncoderSample] = deque(maxlen=3)
        # Per ns and per ns^2: divided differences of the last samples; None where they are too far apart.
        self._slope: Array | None = None
        self._bend: Array | None = None

    def add(self, sample: EncoderSample) -> None:
        """Note a sample that the track has taken."""
        if not self._last or sample.t_capture_ns - self._last[-1].t_capture_ns >= _LEAST_STEP_NS:
            self._last.append(sample)
            self._slope, self._bend = self._differences()

    def at(self, t_ns: int) -> Joints | None:
        """Return the joints at `t_ns`; None if the encoders say nothing about it."""
        found = self._encoders.at(t_ns, self._max_gap_ns)
        if not isinstance(found, Miss):
            return Joints(found.positions, 0, found.gap_ns, found.newest_ns)
        if found is not Miss.NOT_YET or not self._last:
            return None
        newest_ns = self._last[-1].t_capture_ns
        ahead_ns = t_ns - newest_ns
        if ahead_ns > self._max_gap_ns:
            return None
        return Joints(self._forecast(ahead_ns), ahead_ns, ahead_ns, newest_ns)

    def _forecast(self, ahead_ns: int) -> Array:
        """Newton's interpolation polynomial through the last samples, carried on."""
        last = self._last[-1]
        if self._slope is None:
            return last.angles_rad
        straight = last.angles_rad + ahead_ns * self._slope
        if self._bend is None:
            return straight
        curved_ns = min(ahead_ns, _CURVED_NS)
        return straight + curved_ns * (curved_ns + last.t_capture_ns - self._last[-2].t_capture_ns) * self._bend

    def _differences(self) -> tuple[Array | None, Array | None]:
        if len(self._last) < 2 or not _regular(self._last[-2], self._last[-1]):
            return None, None
        second, last = self._last[-2], self._last[-1]
        slope = (last.angles_rad - second.angles_rad) / (last.t_capture_ns - second.t_capture_ns)
        if len(self._last) < 3 or not _regular(self._last[-3], second):
            return slope, None
        third = self._last[-3]
        before = (second.angles_rad - third.angles_rad) / (second.t_capture_ns - third.t_capture_ns)
        return slope, (slope - before) / (last.t_capture_ns - third.t_capture_ns)


def _regular(earlier: EncoderSample, later: EncoderSample) -> bool:
    return later.t_capture_ns - earlier.t_capture_ns <= _MOST_STEP_NS
