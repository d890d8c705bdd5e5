"""Device time to host monotonic time: a robust, running fit of offset and drift. Pure: no clock is read here.

A device stamps its samples with its own counter; the host sees when they arrive. Arrival is late by a delay that is never
negative and sometimes long, so the line that explains the pairs is the one *below* all of them that lies closest to them
(the linear program of Moon, Skelly and Towsley, "Estimation and removal of clock skew from network delay measurements",
INFOCOM 1999), found here as an edge of the lower convex hull of the fastest probe of every half second. Slow probes
therefore never move the fit.

The counter may wrap (any period), step, or restart. A step is believed only after several probes agree on it; a single
corrupt stamp is refused.
"""

from collections import deque
from dataclasses import dataclass
from enum import StrEnum

_NS_PER_S = 1_000_000_000
_SETTLE_NS = _NS_PER_S  # until then a faster probe moves the map at once: the first may have been very slow


class ProbeVerdict(StrEnum):
    """What one pair of device time and arrival time did to the fit."""

    USED = "used"  # took part in the fit, or agrees with it
    SLOW = "slow"  # arrived far later than the fit says it could have; its device time still maps well
    SUSPECT = "suspect"  # contradicts the fit; do not use its device time
    STEPPED = "stepped"  # the device clock has stepped: the fit was started anew from the last probes


@dataclass(frozen=True, slots=True)
class ClockFit:
    """The state of a `ClockMap`, for health reports.

    Attributes:
        drift_ppm: How much slower than the host the device clock runs (positive: the host gains on it).
        span_ns: Device time covered by the probes that the fit rests on.
        slow: Probes that arrived far too late.
        suspect: Probes whose device time was refused.
        steps: Confirmed steps or restarts of the device clock.
    """

    drift_ppm: float
    span_ns: int
    slow: int
    suspect: int
    steps: int


def wrap_period_ns(bits: int, tick_ns: int) -> int:
    """Return the period in nanoseconds after which a counter of `bits` bits and ticks of `tick_ns` starts again."""
    return (1 << bits) * tick_ns


class ClockMap:
    """Maps one device clock to host monotonic time. Not thread-safe: one thread feeds and asks it.

    Corrections are spread over time (`slew`), so that the map never runs backwards, except in the first second and after
    a step, when they are made at once. It needs one `update` before the first `to_host_ns`.

    Args:
        wrap_ns: Device times are counted modulo this; None if they never wrap. See `wrap_period_ns`.
        latency_ns: The least delay between latch and arrival, if known; taken off every result.
        max_drift_ppm: No real clock drifts by more.
        window_s: The fit forgets what is older.
        step_ns: A probe that is this far from the fit on the impossible side contradicts it; one that is this far
            on the late side is called slow.
        confirm: So many probes in a row must agree on a new offset before a step is believed.
        slow_confirm_s: A constant lateness without the device time stepping back is believed to be a step after this.
        slew: Corrections move the map by at most this fraction of the time passed; below 1 it stays increasing.
    """

    def __init__(
        self,
        wrap_ns: int | None = None,
        *,
        latency_ns: int = 0,
        max_drift_ppm: float = 1000.0,
        window_s: float = 30.0,
        step_ns: int = 50_000_000,
        confirm: int = 5,
        slow_confirm_s: float = 5.0,
        slew: float = 0.05,
    ) -> None:
        if wrap_ns is not None and wrap_ns <= 0:
            raise ValueError("wrap_ns must be positive")
        if not 0 < slew < 1:
            raise ValueError("slew must be between 0 and 1")
        self._wrap_ns = wrap_ns
        self._latency_ns = latency_ns
        self._max_drift = max_drift_ppm * 1e-6
        self._step_ns = step_ns if wrap_ns is None else min(step_ns, max(wrap_ns // 8, 1))
        self._confirm = max(confirm, 1)
        self._slow_confirm_ns = round(slow_confirm_s * _NS_PER_S)
        self._slew = slew
        self._bucket_ns = _NS_PER_S // 2
        self._min_span_ns = 2 * _NS_PER_S
        self._max_buckets = max(int(window_s * _NS_PER_S) // self._bucket_ns, 4)
        self._buckets: deque[tuple[int, int]] = deque()  # closed: fastest (unwrapped device time, arrival) of each
        self._best: tuple[int, int] | None = None  # of the open bucket
        self._bucket_start_ns = 0
        self._started_ns = 0
        self._origin: tuple[int, int] | None = None  # a point on the fitted line
        self._drift = 0.0  # slope - 1
        self._correction_ns = 0.0  # applied map = fitted line + this; slewed to zero
        self._last: tuple[int, int] = (0, 0)  # last believed (unwrapped device time, arrival)
        self._doubt: list[tuple[int, int]] = []  # consecutive probes that contradict the fit
        self._late: list[tuple[int, int]] = []  # the first and the last few of consecutive, equally slow probes
        self._slow = self._suspect = self._steps = 0

    @property
    def fit(self) -> ClockFit:
        """The present state of the fit."""
        first = self._buckets[0] if self._buckets else self._best
        span_ns = self._last[0] - first[0] if first is not None else 0
        return ClockFit(self._drift * 1e6, span_ns, self._slow, self._suspect, self._steps)

    @property
    def ready(self) -> bool:
        """Whether there has been a probe, so that `to_host_ns` can answer."""
        return self._origin is not None

    def to_host_ns(self, t_device_ns: int) -> int:
        """Return the host monotonic time of a device time near the last probe's.

        Raises:
            ValueError: There has been no probe yet.
        """
        if self._origin is None:
            raise ValueError("ClockMap.to_host_ns before the first update")
        device_ns = self._unwrap(t_device_ns, self._last[0])
        return self._line_ns(device_ns) + round(self._correction_ns) - self._latency_ns

    def update(self, t_device_ns: int, t_arrival_ns: int) -> ProbeVerdict:
        """Take in one pair. `t_device_ns` is raw (wrapped); `t_arrival_ns` is host time and does not decrease."""
        if self._origin is None:
            self._restart([(t_device_ns, t_arrival_ns)])
            return ProbeVerdict.USED
        expected_ns = self._last[0] + (t_arrival_ns - self._last[1])
        probe = (self._unwrap(t_device_ns, expected_ns), t_arrival_ns)
        late_ns = t_arrival_ns - self._line_ns(probe[0])
        stepped_back = probe[0] < self._last[0] - self._step_ns
        if late_ns < -self._step_ns or (stepped_back and late_ns > self._step_ns):
            return self._contradicted(probe)
        self._doubt.clear()
        if late_ns > self._step_ns:
            return self._too_late(probe)
        self._late.clear()
        self._slew_to(probe[0])
        self._take(probe, late_ns)
        return ProbeVerdict.USED

    def stamp(self, t_device_ns: int, t_arrival_ns: int) -> int | None:
        """Take in one pair and return its host time, never later than its arrival; None if its device time is suspect."""
        if self.update(t_device_ns, t_arrival_ns) is ProbeVerdict.SUSPECT:
            return None
        return min(self.to_host_ns(t_device_ns), t_arrival_ns - self._latency_ns)

    def foresee(self, t_device_ns: int, t_arrival_ns: int) -> None:
        """Take note that a later sample of the same delivery is already here, before those ahead of it are taken in.

        The last of a burst is the least late of it: knowing it first places the others rightly, where the fit is still young.
        """
        if self._origin is None:
            return
        device_ns = self._unwrap(t_device_ns, self._last[0] + t_arrival_ns - self._last[1])
        late_ns = t_arrival_ns - self._line_ns(device_ns)
        if device_ns - self._started_ns <= _SETTLE_NS and -self._step_ns <= late_ns < 0:
            self._origin = (self._origin[0], self._origin[1] + late_ns)

    def _unwrap(self, t_device_ns: int, near_ns: int) -> int:
        if self._wrap_ns is None:
            return t_device_ns
        turns = (2 * (near_ns - t_device_ns) + self._wrap_ns) // (2 * self._wrap_ns)
        return t_device_ns + turns * self._wrap_ns

    def _line_ns(self, device_ns: int) -> int:
        device0_ns, host0_ns = self._origin or (0, 0)
        passed_ns = device_ns - device0_ns
        return host0_ns + passed_ns + round(self._drift * passed_ns)

    def _restart(self, probes: list[tuple[int, int]]) -> None:
        """Start the fit anew from `probes`: no drift, the least offset among them."""
        self._buckets.clear()
        self._best = None
        self._drift = 0.0
        self._correction_ns = 0.0
        self._origin = min(probes, key=lambda probe: probe[1] - probe[0])
        self._bucket_start_ns = self._started_ns = probes[0][0]
        self._doubt.clear()
        self._late.clear()
        for probe in probes:
            self._take(probe, probe[1] - self._line_ns(probe[0]))

    def _take(self, probe: tuple[int, int], late_ns: int) -> None:
        """Let a believed probe take part in the fit."""
        if late_ns < 0 and self._origin is not None:  # faster than any before: the line must go below it at once
            self._origin = (self._origin[0], self._origin[1] + late_ns)
            if probe[0] - self._started_ns > _SETTLE_NS:
                self._correction_ns -= late_ns
        if probe[0] - self._bucket_start_ns >= self._bucket_ns and self._best is not None:
            self._close_bucket(probe[0])
        if self._best is None or max(late_ns, 0) < self._best[1] - self._line_ns(self._best[0]):
            self._best = probe
        if probe[0] > self._last[0] or not self._buckets:
            self._last = probe

    def _close_bucket(self, device_ns: int) -> None:
        if self._best is not None:
            self._buckets.append(self._best)
        self._best = None
        self._bucket_start_ns = device_ns
        horizon_ns = device_ns - self._max_buckets * self._bucket_ns
        while len(self._buckets) > 1 and self._buckets[0][0] < horizon_ns:
            self._buckets.popleft()
        before_ns = self._line_ns(device_ns)
        self._refit()
        self._correction_ns += before_ns - self._line_ns(device_ns)

    def _refit(self) -> None:
        """Lay the line through the hull edge below the probes' mean device time."""
        device0_ns, host0_ns = self._buckets[0]
        span_ns = self._buckets[-1][0] - device0_ns
        if span_ns < self._min_span_ns:
            return
        points = [(device - device0_ns, (host - host0_ns) - (device - device0_ns)) for device, host in self._buckets]
        hull: list[tuple[int, int]] = []
        for point in points:
            while len(hull) > 1 and _turns_right(hull[-2], hull[-1], point):
                hull.pop()
            hull.append(point)
        middle_ns = sum(point[0] for point in points) / len(points)
        index = 1
        while index < len(hull) - 1 and hull[index][0] < middle_ns:
            index += 1
        (x0, y0), (x1, y1) = hull[index - 1], hull[index]
        drift = max(-self._max_drift, min(self._max_drift, (y1 - y0) / (x1 - x0)))
        least_ns = min(y - drift * x for x, y in points)  # equals the edge unless the drift was limited
        self._drift = drift
        self._origin = (device0_ns, host0_ns + round(least_ns))

    def _slew_to(self, device_ns: int) -> None:
        step_ns = self._slew * max(device_ns - self._last[0], 0)
        if self._correction_ns > 0:
            self._correction_ns = max(self._correction_ns - step_ns, 0.0)
        else:
            self._correction_ns = min(self._correction_ns + step_ns, 0.0)

    def _contradicted(self, probe: tuple[int, int]) -> ProbeVerdict:
        self._late.clear()
        if self._doubt:  # unwrap among themselves: they may lie anywhere in the period
            last = self._doubt[-1]
            probe = (self._unwrap(probe[0], last[0] + probe[1] - last[1]), probe[1])
            drift_ns = abs((probe[1] - probe[0]) - (last[1] - last[0]))
            if drift_ns > self._step_ns or probe[0] <= last[0]:
                self._doubt.clear()
        self._doubt.append(probe)
        if len(self._doubt) < self._confirm:
            self._suspect += 1
            return ProbeVerdict.SUSPECT
        return self._believe_step(list(self._doubt))

    def _too_late(self, probe: tuple[int, int]) -> ProbeVerdict:
        """Slow probes end when a backlog is drained; a lateness that stays the same for seconds is a step."""
        self._slow += 1
        if self._late:
            spread_ns = abs((probe[1] - probe[0]) - (self._late[0][1] - self._late[0][0]))
            if spread_ns > self._step_ns // 2:
                self._late.clear()
        self._late.append(probe)
        if probe[0] > self._last[0]:
            self._last = (probe[0], self._last[1] + probe[0] - self._last[0])
        if probe[1] - self._late[0][1] >= self._slow_confirm_ns and len(self._late) >= self._confirm:
            return self._believe_step(self._late[-self._confirm :])
        del self._late[1 : -self._confirm]
        return ProbeVerdict.SLOW

    def _believe_step(self, probes: list[tuple[int, int]]) -> ProbeVerdict:
        self._steps += 1
        self._restart(probes)
        return ProbeVerdict.STEPPED


def _turns_right(a: tuple[int, int], b: tuple[int, int], c: tuple[int, int]) -> bool:
    """Whether b lies on or above the line from a to c, and so is no corner of the lower hull."""
    return (b[0] - a[0]) * (c[1] - a[1]) <= (b[1] - a[1]) * (c[0] - a[0])
