"""Ground truth of a recording, at any instant."""

from bisect import bisect_right
from collections.abc import Iterable

from ghest_rt.geometry.se3 import interpolate
from ghest_rt.geometry.so3 import Array, slerp
from ghest_rt.messages.results import TruthSample


class TruthTrack:
    """Truth samples in the order of time, interpolated between neighbours (rotations along the geodesic)."""

    def __init__(self) -> None:
        self._times_ns: list[int] = []
        self._samples: list[TruthSample] = []

    @classmethod
    def of(cls, samples: Iterable[TruthSample]) -> "TruthTrack":
        """Return the truth at any instant from samples in the order of time."""
        track = cls()
        for sample in samples:
            track.add(sample)
        return track

    def __len__(self) -> int:
        return len(self._samples)

    def add(self, sample: TruthSample) -> None:
        """Append a sample; one that is not later than the last is ignored."""
        if not self._times_ns or sample.t_ns > self._times_ns[-1]:
            self._times_ns.append(sample.t_ns)
            self._samples.append(sample)

    def at(self, t_ns: int) -> TruthSample | None:
        """Return the truth at `t_ns`, or None outside the time covered."""
        index = bisect_right(self._times_ns, t_ns) - 1
        if index < 0:
            return None
        before = self._samples[index]
        if before.t_ns == t_ns:
            return before
        if index + 1 >= len(self._samples):
            return None
        after = self._samples[index + 1]
        fraction = (t_ns - before.t_ns) / (after.t_ns - before.t_ns)

        def between(T_0: Array, T_1: Array) -> Array:
            return interpolate(T_0, T_1, fraction)

        return TruthSample(
            t_ns=t_ns,
            gh_from_arm=slerp(before.gh_from_arm, after.gh_from_arm, fraction),
            m0_from_arm=between(before.m0_from_arm, after.m0_from_arm),
            e_from_m0=between(before.e_from_m0, after.e_from_m0),
            e_from_m1=between(before.e_from_m1, after.e_from_m1),
            e_from_arm=between(before.e_from_arm, after.e_from_arm),
            joints_rad={
                name: (1.0 - fraction) * value + fraction * after.joints_rad[name]
                for name, value in before.joints_rad.items()
                if name in after.joints_rad
            },
            elbow_rad=_between_angles(before.elbow_rad, after.elbow_rad, fraction),
        )


def _between_angles(
    before: tuple[float, float] | None, after: tuple[float, float] | None, fraction: float
) -> tuple[float, float] | None:
    if before is None or after is None:
        return None
    rest = 1.0 - fraction
    return rest * before[0] + fraction * after[0], rest * before[1] + fraction * after[1]
