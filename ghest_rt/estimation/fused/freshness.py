"""How old the inputs may be for angles to be plainly valid; section 8 of docs/fused-estimator.md."""

from collections.abc import Sequence

# Encoder samples farther apart than this are a gap, and so is a forecast that goes as far beyond the newest: an arm that is
# stopped from 100 deg/s within 50 ms is 1 deg away from it by then, and 2 deg after 45 ms. No known link is slower than 40 Hz.
_ENCODER_GAP_NS = 32_000_000
# A camera's latency is followed by a tenth per frame downwards, by a hundredth upwards: a busy machine holds frames up now and
# then.
_FOLLOW, _FOLLOW_UP = 0.1, 0.01
# Frames come this much later than usual now and then.
_JITTER_NS = 8_000_000
# A sighting older than this, and than so many frame periods, is too old even if frames have come late for long: a machine that
# is always busy is no slow camera.
_OLDEST_NS, _OLDEST_FRAMES = 80_000_000, 3
# One sighting at the start or after an outage tells where a marker is, only the next ones how fast it moves.
_SIGHTINGS = 3


class Freshness:
    """Knows the latency of each camera, and hence which marker has not been seen for longer than usual."""

    def __init__(self, period_ns: Sequence[int]) -> None:
        """Start without frames.

        Args:
            period_ns: Nominal frame period of the camera of m0, and of that of m1.
        """
        self._patience_ns = [8 * period // 5 for period in period_ns]
        self._oldest_ns = [max(_OLDEST_NS, _OLDEST_FRAMES * period) for period in period_ns]
        self._latency_ns: list[float | None] = [None] * len(period_ns)
        self._taken_ns: list[int | None] = [None] * len(period_ns)
        self._in_a_row = [0] * len(period_ns)

    def saw(self, which: int, latency_ns: int) -> None:
        """Note how long after its capture a frame of marker `which` arrived."""
        known = self._latency_ns[which]
        if known is None:
            self._latency_ns[which] = float(latency_ns)
        else:
            follow = _FOLLOW_UP if latency_ns > known else _FOLLOW
            self._latency_ns[which] = known + follow * (latency_ns - known)

    def took(self, which: int, t_ns: int) -> None:
        """Note that the filter has taken a sighting of marker `which`, captured at `t_ns`."""
        before_ns = self._taken_ns[which]
        follows = before_ns is None or t_ns - before_ns <= self._oldest_ns[which]
        self._in_a_row[which] = self._in_a_row[which] + 1 if follows else 1
        self._taken_ns[which] = t_ns if before_ns is None else max(t_ns, before_ns)

    def returning(self) -> bool:
        """Return whether a marker has been seen too few times since the start or an outage: its speed is not known yet."""
        return min(self._in_a_row) < _SIGHTINGS

    def stale(self, seen_ns: Sequence[int], t_ns: int) -> tuple[int, ...]:
        """Return the markers whose newest sighting is older than latency and frame rate account for, or than any may be.

        Args:
            seen_ns: When m0 and m1 were last seen.
            t_ns: The instant that is asked for.
        """
        return tuple(which for which, seen in enumerate(seen_ns) if t_ns - seen > self._allowed_ns(which))

    def _allowed_ns(self, which: int) -> float:
        usual_ns = (self._latency_ns[which] or 0.0) + self._patience_ns[which] + _JITTER_NS
        return min(usual_ns, self._oldest_ns[which])


def encoders_overdue(gap_ns: int) -> bool:
    """Return whether joints rest on encoder samples so far apart, or on a forecast so far beyond the newest."""
    return gap_ns > _ENCODER_GAP_NS
