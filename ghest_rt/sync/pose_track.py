"""The poses of one marker over the last seconds, and its pose at any instant between them."""

from dataclasses import dataclass

from ghest_rt.geometry.se3 import interpolate
from ghest_rt.geometry.so3 import Array
from ghest_rt.sync.history import History
from ghest_rt.sync.miss import Miss

# Motion within this time is far below anything measurable: an instant this near to a sample is that sample's.
EXACT_NS = 1_000
_CAPACITY = 256


@dataclass(frozen=True, slots=True, eq=False)
class PoseSample:
    """A marker's pose at one instant.

    Attributes:
        t_ns: The instant, host time.
        e_from_marker: (4, 4) pose in the exoskeleton base frame, metres.
        covariance: (6, 6) of (rotation error rad, translation error m) in E axes; None if unknown.
        color_only: Depth took no part in it.
        fewer_disks: It rests on fewer than four disks.
        bridged: Something it rests on was interpolated over a gap longer than normal.
        newest_ns: Capture time of the newest frame it rests on.
        encoders_ns: Latch time of the newest encoder sample it rests on; None if it needs none.
    """

    t_ns: int
    e_from_marker: Array
    covariance: Array | None
    color_only: bool
    fewer_disks: bool
    bridged: bool
    newest_ns: int
    encoders_ns: int | None


class PoseTrack:
    """A bounded history of poses; nothing is ever extrapolated."""

    def __init__(self, period_ns: int) -> None:
        """Start empty.

        Args:
            period_ns: Nominal time between samples; a gap of more than 1.6 of them counts as bridged.
        """
        self._bridge_ns = 8 * period_ns // 5
        self._history: History[PoseSample] = History(_CAPACITY)

    def __len__(self) -> int:
        return len(self._history)

    @property
    def newest_ns(self) -> int | None:
        """Time of the newest pose; None if there is none."""
        return self._history.newest_ns

    def add(self, sample: PoseSample) -> bool:
        """Take a sample in any order; return False if there is one of that very time."""
        return self._history.insert(sample.t_ns, sample)

    def at(self, t_ns: int, max_gap_ns: int) -> PoseSample | Miss:
        """Return the pose at `t_ns`: the sample itself on an exact hit, otherwise between the samples on either side.

        The rotation follows the geodesic, the position the chord. The covariance is the weighted mean of the neighbours':
        never less than that of the interpolated pose, however the errors of the two are correlated.

        Args:
            t_ns: The instant, host time.
            max_gap_ns: The farthest that the two samples may lie apart.

        Returns:
            The pose, or why there is none.
        """
        if not len(self._history):
            return Miss.EMPTY
        before, after = self._history.before(t_ns), self._history.after(t_ns)
        if before is not None and t_ns - before[0] <= EXACT_NS:
            return before[1]
        if after is not None and after[0] - t_ns <= EXACT_NS:
            return after[1]
        if before is None:
            return Miss.TOO_EARLY
        if after is None:
            return Miss.NOT_YET
        t_0, first = before
        t_1, second = after
        if t_1 - t_0 > max_gap_ns:
            return Miss.GAP
        fraction = (t_ns - t_0) / (t_1 - t_0)
        covariance = None
        if first.covariance is not None and second.covariance is not None:
            covariance = (1.0 - fraction) * first.covariance + fraction * second.covariance
        return PoseSample(
            t_ns=t_ns,
            e_from_marker=interpolate(first.e_from_marker, second.e_from_marker, fraction),
            covariance=covariance,
            color_only=first.color_only or second.color_only,
            fewer_disks=first.fewer_disks or second.fewer_disks,
            bridged=first.bridged or second.bridged or t_1 - t_0 > self._bridge_ns,
            newest_ns=second.newest_ns,
            encoders_ns=second.encoders_ns,
        )
