"""How the service itself is doing: rates, lateness, memory, processor time."""

import os
import time
from collections.abc import Mapping
from pathlib import Path

from ghest_rt.messages.published import Health, InputHealth, Lateness
from ghest_rt.messages.results import GhEstimate, Reason, Status
from ghest_rt.service.inputs import InputCounters
from ghest_rt.service.pacing import Pacer

_STATM = Path("/proc/self/statm")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


def resident_mb() -> float:
    """Return the resident memory of this process in MB; 0 where /proc is missing."""
    try:
        return int(_STATM.read_text().split()[1]) * _PAGE_BYTES / 1e6
    except OSError:
        return 0.0


class SampleCounts:
    """Counts of what was published, and the newest status."""

    def __init__(self) -> None:
        self.published = 0
        self.valid = 0
        self.degraded = 0
        self.starting = 0
        self._t_first_ns: int | None = None
        self._t_last_ns = 0
        self.status = Status.LOST
        self.reason = Reason.STARTING

    def add(self, estimate: GhEstimate) -> None:
        """Count one published sample."""
        self.published += 1
        self.valid += estimate.status is Status.VALID
        self.degraded += estimate.status is Status.DEGRADED
        self.starting += estimate.reason is Reason.STARTING
        self.status, self.reason = estimate.status, estimate.reason
        if estimate.reason is not Reason.STARTING:
            if self._t_first_ns is None:
                self._t_first_ns = estimate.t_sample_ns
            self._t_last_ns = estimate.t_sample_ns

    @property
    def duration_s(self) -> float:
        """From the instant of the first sample after the start to that of the last one."""
        return 0.0 if self._t_first_ns is None else (self._t_last_ns - self._t_first_ns) * 1e-9


class HealthMeter:
    """Makes Health messages; rates hold for the time since the message before."""

    def __init__(self, t_start_ns: int, counts: SampleCounts, pacer: Pacer, inputs: Mapping[str, InputCounters]) -> None:
        self._counts = counts
        self._pacer = pacer
        self._inputs = inputs
        self._t_start_ns = t_start_ns
        self._t_last_ns = t_start_ns
        self._cpu_last_s = time.process_time()
        self._wall_last_s = time.monotonic()
        self._published_last = 0
        self._received_last: dict[str, int] = {}

    def measure(self, seq: int, t_ns: int, t_unix_ns: int) -> Health:
        """Return message number `seq`, the state at `t_ns` (service clock)."""
        counts, pacer = self._counts, self._pacer
        elapsed_s = max((t_ns - self._t_last_ns) * 1e-9, 1e-9)
        cpu_s, wall_s = time.process_time(), time.monotonic()
        message = Health(
            seq=seq,
            t_ns=t_ns,
            t_unix_ns=t_unix_ns,
            uptime_s=(t_ns - self._t_start_ns) * 1e-9,
            status=counts.status,
            reason=counts.reason,
            published=counts.published,
            valid=counts.valid,
            rate_hz=(counts.published - self._published_last) / elapsed_s,
            missed_ticks=pacer.missed,
            lateness=lateness(pacer),
            inputs={name: self._input(name, counters, elapsed_s) for name, counters in self._inputs.items()},
            cpu_percent=100.0 * (cpu_s - self._cpu_last_s) / max(wall_s - self._wall_last_s, 1e-9),
            memory_mb=resident_mb(),
        )
        self._t_last_ns, self._cpu_last_s, self._wall_last_s = t_ns, cpu_s, wall_s
        self._published_last = counts.published
        return message

    def _input(self, name: str, counters: InputCounters, elapsed_s: float) -> InputHealth:
        received = counters.received
        rate_hz = (received - self._received_last.get(name, 0)) / elapsed_s
        self._received_last[name] = received
        return InputHealth(
            state=counters.state,
            received=received,
            missing=counters.missing,
            skipped=counters.skipped,
            bad=counters.bad,
            reopened=counters.reopened,
            rate_hz=rate_hz,
        )


def lateness(pacer: Pacer) -> Lateness:
    """Return how late the ticks have come so far."""
    histogram = pacer.lateness
    return Lateness(
        p50_us=histogram.percentile_us(50.0),
        p99_us=histogram.percentile_us(99.0),
        p999_us=histogram.percentile_us(99.9),
        max_us=histogram.max_us,
    )
