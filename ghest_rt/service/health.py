"""How the service itself is doing: rates, lateness, memory, processor time."""

import os
import resource
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from ghest_drivers.samples import DeviceVitals
from ghest_rt.messages.published import Health, InputHealth, Lateness, LatenessHistogram
from ghest_rt.messages.results import GhEstimate, Reason, Status
from ghest_rt.service.inputs import InputCounters
from ghest_rt.service.pacing import Pacer
from ghest_rt.service.process import GarbageRounds

_STATM = Path("/proc/self/statm")
_TASKS = Path("/proc/self/task")
_OPEN_FILES = Path("/proc/self/fd")
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
_PERCENTS = (50.0, 99.0, 99.9, 100.0)
_EDGES_OCTAVES = tuple(range(4, 22))  # 16 us .. 2.1 s, each twice the one before
_EDGES_US = tuple(float(2**octave) for octave in _EDGES_OCTAVES)


def resident_mb() -> float:
    """Return the resident memory of this process in MB; 0 where /proc is missing."""
    try:
        return int(_STATM.read_text().split()[1]) * _PAGE_BYTES / 1e6
    except OSError:
        return 0.0


def entries(folder: Path) -> int:
    """Return how many entries a folder of /proc has; 0 where it is missing."""
    try:
        return sum(1 for _ in folder.iterdir())
    except OSError:
        return 0


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
    """Makes Health messages; rates hold for the time since the message before.

    Args:
        t_start_ns: Start of the run, service clock.
        counts: What was published.
        pacer: Who knows the lateness.
        inputs: Counters by input.
        vitals: What an input's device says of itself.
        unused: Samples that the estimator did not use, by reason.
        garbage: Who collects garbage.
    """

    def __init__(
        self,
        t_start_ns: int,
        counts: SampleCounts,
        pacer: Pacer,
        inputs: Mapping[str, InputCounters],
        *,
        vitals: Callable[[str], DeviceVitals] = lambda name: DeviceVitals(),
        unused: Callable[[], Mapping[str, int]] = dict,
        garbage: GarbageRounds | None = None,
    ) -> None:
        self._vitals = vitals
        self._unused = unused
        self._garbage = garbage
        self._major_faults_before = resource.getrusage(resource.RUSAGE_SELF).ru_majflt
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
            degraded=counts.degraded,
            rate_hz=(counts.published - self._published_last) / elapsed_s,
            missed_ticks=pacer.missed,
            lateness=lateness(pacer),
            lateness_recent=_recent(pacer),
            lateness_histogram=_histogram(pacer),
            unused=dict(self._unused()),
            inputs={name: self._input(name, counters, elapsed_s, t_ns) for name, counters in self._inputs.items()},
            cpu_percent=100.0 * (cpu_s - self._cpu_last_s) / max(wall_s - self._wall_last_s, 1e-9),
            memory_mb=resident_mb(),
            threads=entries(_TASKS),
            open_files=entries(_OPEN_FILES),
            major_faults=resource.getrusage(resource.RUSAGE_SELF).ru_majflt - self._major_faults_before,
            collection_ms=0.0 if self._garbage is None else self._garbage.longest_ms,
        )
        self._t_last_ns, self._cpu_last_s, self._wall_last_s = t_ns, cpu_s, wall_s
        self._published_last = counts.published
        return message

    def _input(self, name: str, counters: InputCounters, elapsed_s: float, t_ns: int) -> InputHealth:
        received = counters.received
        rate_hz = (received - self._received_last.get(name, 0)) / elapsed_s
        self._received_last[name] = received
        vitals = self._vitals(name)
        return InputHealth(
            state=counters.state,
            received=received,
            missing=counters.missing,
            skipped=counters.skipped,
            bad=counters.bad,
            reopened=counters.reopened,
            rate_hz=rate_hz,
            age_ms=None if counters.newest_ns is None else (t_ns - counters.newest_ns) * 1e-6,
            refused={reason: count for reason, count in vitals.refused.items() if count},
            temperature_c=vitals.temperature_c,
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


def _recent(pacer: Pacer) -> Lateness:
    p50_us, p99_us, p999_us, max_us = pacer.recent.percentiles_us(_PERCENTS)
    return Lateness(p50_us=p50_us, p99_us=p99_us, p999_us=p999_us, max_us=max_us)


def _histogram(pacer: Pacer) -> LatenessHistogram:
    lateness = pacer.lateness
    return LatenessHistogram(
        le_us=_EDGES_US, ticks=lateness.counts_up_to(_EDGES_OCTAVES), count=lateness.count, sum_us=lateness.sum_us
    )
