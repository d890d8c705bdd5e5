"""The encoder samples of the last seconds, and the joint angles at any instant between them."""

from collections import Counter
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from ghest_drivers.samples import EncoderSample
from ghest_rt.geometry.so3 import Array
from ghest_rt.sync.history import History
from ghest_rt.sync.miss import Miss

# Real exports repeat about 1 % of their rows, unchanged, 0-2 ms after the original.
_REPEAT_NS = 2_000_000
# A latch cannot lie after its delivery; this much is left to the error of the clock map.
_FUTURE_NS = 20_000_000
# A joint this far beyond its mechanical stop is a bad reading, not a posture.
_LIMIT_MARGIN = 0.2
_CAPACITY = 2048
# Neighbours that come in the wrong order are put right this far back; farther back the clock has stepped.
_REORDER_NS = 100_000_000


class EncoderRejection(StrEnum):
    """Why an encoder sample was not taken."""

    DUPLICATE = "duplicate"  # the same latch instant, or the newest sample's number, again
    REPEATED = "repeated"  # the newest row unchanged, 0-2 ms later
    STEPPED_BACK = "stepped_back"  # far older than the newest: the clock stepped, or the sample was held up
    FROM_THE_FUTURE = "from_the_future"  # latched after it was delivered
    WRONG_SIZE = "wrong_size"  # not one angle per joint
    NOT_FINITE = "not_finite"
    BEYOND_LIMITS = "beyond_limits"  # outside the URDF's joint limits by more than 0.2 rad


class JointState(NamedTuple):
    """Joint positions at an instant.

    Attributes:
        positions: (n,) rad (m for prismatic joints), in the order of the encoder link.
        newest_ns: Latch time of the newest sample they rest on.
        gap_ns: Time between the two samples they were interpolated from; 0 for a sample itself.
    """

    positions: Array
    newest_ns: int
    gap_ns: int


class EncoderTrack:
    """A bounded history of encoder samples that takes duplicates, reordering, repeats and steps of the clock.

    Attributes:
        rejected: How many samples were not taken, by reason.
        last_rejection: Why the sample offered last was not taken; None if it was.
    """

    def __init__(self, limits: Array) -> None:
        """Start empty.

        Args:
            limits: (n, 2) least and greatest position of each joint; infinite where unknown.
        """
        # Finite, so that what is within them is.
        lower, upper = np.nan_to_num((limits + np.array([-_LIMIT_MARGIN, _LIMIT_MARGIN])).T)
        self._lower: list[float] = lower.tolist()
        self._upper: list[float] = upper.tolist()
        self._history: History[EncoderSample] = History(_CAPACITY)
        self._newest: EncoderSample | None = None
        self.rejected: Counter[EncoderRejection] = Counter()
        self.last_rejection: EncoderRejection | None = None

    def __len__(self) -> int:
        return len(self._history)

    @property
    def newest_ns(self) -> int | None:
        """Latch time of the newest sample; None if there is none."""
        return self._history.newest_ns

    def add(self, sample: EncoderSample) -> EncoderRejection | None:
        """Take a sample, in any order; return why it was not taken, or None."""
        self.last_rejection = self._reason_against(sample)
        if self.last_rejection is not None:
            self.rejected[self.last_rejection] += 1
        elif self._newest is None or sample.t_capture_ns > self._newest.t_capture_ns:
            self._newest = sample
        return self.last_rejection

    def _reason_against(self, sample: EncoderSample) -> EncoderRejection | None:
        angles = sample.angles_rad
        if angles.shape != (len(self._lower),):
            return EncoderRejection.WRONG_SIZE
        if not all(low <= angle <= high for low, angle, high in zip(self._lower, angles.tolist(), self._upper, strict=True)):
            return EncoderRejection.BEYOND_LIMITS if np.isfinite(angles).all() else EncoderRejection.NOT_FINITE
        if sample.t_capture_ns > sample.t_arrival_ns + _FUTURE_NS:
            return EncoderRejection.FROM_THE_FUTURE
        newest = self._newest
        if newest is not None:
            since_ns = sample.t_capture_ns - newest.t_capture_ns
            if since_ns < -_REORDER_NS:
                return EncoderRejection.STEPPED_BACK
            if abs(since_ns) <= _REPEAT_NS:
                if sample.seq == newest.seq:
                    return EncoderRejection.DUPLICATE
                if np.array_equal(angles, newest.angles_rad):
                    return EncoderRejection.REPEATED
        if not self._history.insert(sample.t_capture_ns, sample):
            return EncoderRejection.DUPLICATE
        return None

    def at(self, t_ns: int, max_gap_ns: int) -> JointState | Miss:
        """Return the joint positions at `t_ns`, interpolated linearly between the samples on either side.

        Args:
            t_ns: The instant, host time.
            max_gap_ns: The farthest that the two samples may lie apart.

        Returns:
            The joint positions, or why there are none. Nothing is ever extrapolated.
        """
        before = self._history.before(t_ns)
        if before is None:
            return Miss.TOO_EARLY if len(self._history) else Miss.EMPTY
        t_0, first = before
        if t_0 == t_ns:
            return JointState(first.angles_rad, t_0, 0)
        after = self._history.after(t_ns)
        if after is None:
            return Miss.NOT_YET
        t_1, second = after
        if t_1 - t_0 > max_gap_ns:
            return Miss.GAP
        fraction = (t_ns - t_0) / (t_1 - t_0)
        return JointState((1.0 - fraction) * first.angles_rad + fraction * second.angles_rad, t_1, t_1 - t_0)

    def nearest(self, t_ns: int) -> EncoderSample | None:
        """Return the sample nearest in time (the earlier of two equally near), or None if there is none."""
        before, after = self._history.before(t_ns), self._history.after(t_ns)
        if before is None or after is None:
            found = before or after
            return None if found is None else found[1]
        return before[1] if t_ns - before[0] <= after[0] - t_ns else after[1]
