"""Counts to joint angles, and whether a joint can be there at all."""

import math
from dataclasses import dataclass

from ghest_drivers.hardware.encoders.stats import Rejection

_TURN_RAD = 2.0 * math.pi
_LEAST_DT_NS = 5_000_000  # below this, latch jitter would dominate a rate


@dataclass(frozen=True, slots=True)
class Channel:
    """One encoder: angle = sign * (counts - zero_counts) * rad_per_count + offset_rad.

    Attributes:
        joint: URDF joint it measures.
        source: Where its counts are: field of a frame or line, "Message.Signal", node id, or column title.
        rad_per_count: Radians per count.
        zero_counts: Counts at which the encoder itself reads zero.
        sign: +1, or -1 where counts decrease as the joint angle grows.
        offset_rad: Joint angle where the encoder reads zero.
        wrap: A single-turn encoder: the angle is taken modulo one turn to the value nearest the middle of its range.
        min_rad: Least plausible joint angle.
        max_rad: Greatest plausible joint angle.
        max_rate_rad_s: Greatest plausible speed; infinite for none.
    """

    joint: str
    source: str
    rad_per_count: float = 1.0
    zero_counts: float = 0.0
    sign: int = 1
    offset_rad: float = 0.0
    wrap: bool = False
    min_rad: float = -math.inf
    max_rad: float = math.inf
    max_rate_rad_s: float = math.inf

    def __post_init__(self) -> None:
        if self.sign not in {1, -1}:
            raise ValueError(f"joint {self.joint}: sign must be 1 or -1")
        if not (math.isfinite(self.rad_per_count) and self.rad_per_count > 0):
            raise ValueError(f"joint {self.joint}: the scale must be positive and finite; reverse it with sign")
        if not self.min_rad < self.max_rad:
            raise ValueError(f"joint {self.joint}: the lower limit must be below the upper")
        if self.wrap and math.isfinite(self.min_rad + self.max_rad) and self.max_rad - self.min_rad > _TURN_RAD:
            raise ValueError(f"joint {self.joint}: a single-turn encoder cannot serve a range of more than one turn")

    @property
    def middle_rad(self) -> float:
        """The middle of the range, 0 if it is unbounded."""
        middle_rad = (self.min_rad + self.max_rad) / 2
        return middle_rad if math.isfinite(middle_rad) else 0.0


class AngleConverter:
    """Converts the counts of all channels and judges the result. Remembers the last plausible angles."""

    def __init__(self, channels: tuple[Channel, ...]) -> None:
        self._terms = tuple(
            (
                channel.sign * channel.rad_per_count,
                channel.offset_rad - channel.sign * channel.rad_per_count * channel.zero_counts,
                channel.wrap,
                channel.middle_rad,
                channel.min_rad,
                channel.max_rad,
                channel.max_rate_rad_s,
            )
            for channel in channels
        )
        self._last: list[float] | None = None
        self._last_ns = 0

    def convert(self, counts: tuple[float, ...], t_capture_ns: int) -> list[float] | Rejection:
        """Return the joint angles in radians, or why they are implausible.

        Range: each channel's own. Rate: from the last plausible angles, so that after a pause any reachable angle is allowed.
        """
        last = self._last
        dt_s = max(t_capture_ns - self._last_ns, _LEAST_DT_NS) * 1e-9
        angles: list[float] = []
        for index, (gain, offset_rad, wrap, middle_rad, min_rad, max_rad, max_rate) in enumerate(self._terms):
            angle = counts[index] * gain + offset_rad
            if not math.isfinite(angle):
                return Rejection.NOT_FINITE
            if wrap:
                angle -= _TURN_RAD * round((angle - middle_rad) / _TURN_RAD)
            if not min_rad <= angle <= max_rad:
                return Rejection.OUT_OF_RANGE
            if last is not None and abs(angle - last[index]) > max_rate * dt_s:
                return Rejection.TOO_FAST
            angles.append(angle)
        self._last = angles
        self._last_ns = t_capture_ns
        return angles
