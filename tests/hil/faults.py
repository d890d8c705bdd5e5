"""Injects every fault of a device into a running service and measures what the subscriber sees; `python -m tests.chaos.run`."""

import time
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise

from tests.hil.injection import Window
from tests.hil.rig import Rig, Sample

BOTH = ("realsense-serial", "oak-can")
WRONG_DEG = 2.0  # an angle further off than this is not the truth of its instant
_SETTLED = 20  # valid samples in a row
_SILENCE_NS = 200_000_000  # a subscriber to whom nothing comes for so long knows that something is wrong
_RATE_HZ = 66.6
_RECOVERY_S = 15.0
# Later than this after its beginning no sample may be valid during a fault that leaves a device nothing to say: for so long a
# forecast is as good as any.
TELL_NS = 120_000_000


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that goes wrong on the way.

    Attributes:
        name: As in the table.
        devices: Which devices misbehave.
        mode: What the fixtures do.
        reasons: One of these must be told; none where the service sees through the fault.
        seconds: For so long.
        rigs: Where it can happen.
    """

    name: str
    devices: tuple[str, ...]
    mode: str
    reasons: frozenset[str]
    seconds: float = 1.0
    rigs: tuple[str, ...] = BOTH

    @property
    def blind(self) -> bool:
        """Whether a device says nothing true for as long as it lasts."""
        return self.mode in _BLIND


_BLIND = {"swapped", "silent", "unplugged", "garbage", "crc_errors", "bus_off"}


def _fault(name: str, devices: str, mode: str, *reasons: str, seconds: float = 1.0, rigs: tuple[str, ...] = BOTH) -> Fault:
    return Fault(name, tuple(devices.split()), mode, frozenset(reasons), seconds, rigs)


FAULTS = (
    _fault("every other frame dropped (r0)", "r0", "drops"),
    _fault("frames in bursts of 15 (r1)", "r1", "bursts", "r1_no_frames", "bridged"),
    _fault("frozen image (r0)", "r0", "frozen", "r0_no_frames", "bridged"),
    _fault("frozen image (r1)", "r1", "frozen", "r1_no_frames", "bridged"),
    _fault("cameras swapped", "r0 r1", "swapped", "m0_not_seen", "m1_not_seen"),
    _fault("camera silent (r0)", "r0", "silent", "r0_no_frames", "bridged", seconds=1.5),
    _fault("camera lost and back (r1)", "r1", "unplugged", "r1_no_frames", "bridged", seconds=2.0),
    _fault("both cameras lost and back", "r0 r1", "unplugged", "r0_no_frames", "r1_no_frames", seconds=2.0),
    _fault("encoders silent", "encoders", "silent", "encoders_silent", seconds=1.5),
    _fault("encoders: garbage", "encoders", "garbage", "encoders_silent"),
    _fault("encoders: checksum errors", "encoders", "crc_errors", "encoders_silent"),
    _fault("encoders: counter jumps", "encoders", "counter_jumps"),
    _fault("encoders: clock steps by 7 s and back", "encoders", "clock_step"),
    _fault("encoders: clock slews by 500 ppm", "encoders", "clock_slew", seconds=2.0),
    _fault("camera clock steps by 7 s and back (r0)", "r0", "clock_step", rigs=("realsense-serial",)),
    _fault("camera clock slews by 500 ppm (r1)", "r1", "clock_slew", seconds=2.0, rigs=("realsense-serial",)),
    _fault("CAN: error frames only (bus-off)", "encoders", "bus_off", "encoders_silent", rigs=("oak-can",)),
)


@dataclass(frozen=True, slots=True)
class Seen:
    """What the subscriber saw of a fault.

    Attributes:
        rig: With which fixtures.
        fault: Which fault.
        samples: Samples published from its beginning to the recovery.
        states: How many had which status and reason.
        detected_ms: From its beginning to the first sample that is not plainly valid, the withdrawal of the liveliness token,
            or a silence of 0.2 s; None if there was none of it.
        recovered_ms: From its end to the arrival of the first of the valid samples that follow one another; None: never.
        lost: Slots of the grid without angles, from its beginning to the recovery.
        longest_gap_ms: Longest time in which nothing arrived.
        stale: Samples called valid whose angles are not the truth of their instant.
        untold: Samples called valid while a device was blind for longer than TELL_NS.
        worst_deg: The largest error among the samples with angles.
        missing: Samples that were sent and never came.
    """

    rig: str
    fault: Fault
    samples: int
    states: Counter[tuple[str, str]]
    detected_ms: float | None
    recovered_ms: float | None
    stale: int
    untold: int
    worst_deg: float
    missing: int
    lost: int
    longest_gap_ms: float

    @property
    def reasons(self) -> set[str]:
        """The reasons seen."""
        return {reason for _, reason in self.states}


def measure(rig: Rig, fault: Fault) -> Seen:
    """Inject a fault into a rig that is well, and wait until it is well again.

    Raises:
        RuntimeError: It is not well to begin with.
    """
    if not rig.wait_valid(_SETTLED, _RECOVERY_S):
        raise RuntimeError(f"{rig.name}: not well before {fault.name}")
    window = rig.inject(fault.devices, fault.mode, fault.seconds)
    time.sleep(max((window.until_ns - time.monotonic_ns()) * 1e-9, 0.0))
    return judge(rig, fault, window)


def judge(rig: Rig, fault: Fault, window: Window) -> Seen:
    """Wait until a rig is well again after a fault that has ended, and say what the subscriber saw."""
    well = rig.wait_valid(_SETTLED, _RECOVERY_S)
    seen = rig.subscriber.between(window.from_ns, time.monotonic_ns())
    arrivals = [window.from_ns, *(sample.t_received_ns for sample in seen)]
    gaps = [later - earlier for earlier, later in pairwise(arrivals)]
    signs = [sample.t_received_ns for sample in seen if not sample.valid][:1]
    signs += [t_ns for t_ns, is_there in rig.subscriber.tokens if not is_there and t_ns >= window.from_ns][:1]
    signs += [arrivals[k] + _SILENCE_NS for k, gap in enumerate(gaps) if gap > _SILENCE_NS][:1]
    recovered_ns = _recovered_ns(seen, gaps, window.until_ns) if well else None
    until_ns = window.until_ns if recovered_ns is None else max(recovered_ns, window.until_ns)
    with_angles = [sample for sample in seen if sample.body["quaternion_wxyz"] is not None]
    errors = [(sample.valid, _error_deg(rig, sample)) for sample in with_angles]
    slots = round((until_ns - window.from_ns) * 1e-9 * _RATE_HZ)
    return Seen(
        rig=rig.name,
        fault=fault,
        samples=len(seen),
        states=Counter((sample.body["status"], sample.body["reason"]) for sample in seen),
        detected_ms=None if not signs else (min(signs) - window.from_ns) * 1e-6,
        recovered_ms=None if recovered_ns is None else max(recovered_ns - window.until_ns, 0) * 1e-6,
        stale=sum(valid and error > WRONG_DEG for valid, error in errors),
        untold=sum(
            fault.blind and sample.valid and window.from_ns + TELL_NS < sample.body["t_sample_ns"] < window.until_ns
            for sample in seen
        ),
        worst_deg=max((error for _, error in errors), default=0.0),
        missing=_missing(seen),
        lost=max(slots - sum(sample.t_received_ns <= until_ns for sample in with_angles), 0),
        longest_gap_ms=max(gaps, default=0) * 1e-6,
    )


def _recovered_ns(seen: list[Sample], gaps: list[int], until_ns: int) -> int | None:
    """Return when valid samples came for good; `until_ns` if they did all along. `gaps[k]` is the time before sample k."""
    silent = [k - 1 for k, gap in enumerate(gaps) if gap > _SILENCE_NS]
    last_bad = max((k for k, sample in enumerate(seen) if not sample.valid), default=-2)
    last_bad = max([last_bad, *silent])
    if last_bad < -1:
        return until_ns
    return seen[last_bad + 1].t_received_ns if last_bad + 1 < len(seen) else None


def _missing(seen: list[Sample]) -> int:
    """Count gaps in the sequence numbers, process by process."""
    missing = 0
    for earlier, later in pairwise(seen):
        if earlier.body["run_id"] == later.body["run_id"]:
            missing += later.body["seq"] - earlier.body["seq"] - 1
    return missing


def _error_deg(rig: Rig, sample: Sample) -> float:
    if rig.scene is None:
        raise ValueError("there is no truth on a real station")
    return rig.scene.error_deg(sample.body["t_sample_ns"], sample.body["quaternion_wxyz"])


def table(results: list[Seen]) -> str:
    """Return the results as a Markdown table."""
    lines = [
        "| fixtures | fault | the subscriber sees | detected in (ms) | recovered in (ms) | slots without angles "
        "| worst error (°) | stale as fresh |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for seen in results:
        states = [
            f"{status} ({reason})" if reason != "none" else status for (status, reason), n in seen.states.most_common() if n > 2
        ]
        if seen.longest_gap_ms * 1e6 > _SILENCE_NS:
            states.insert(0, f"nothing for {seen.longest_gap_ms / 1000:.1f} s")
        detected = "–" if seen.detected_ms is None else f"{seen.detected_ms:.0f}"
        recovered = "never" if seen.recovered_ms is None else f"{seen.recovered_ms:.0f}"
        lines.append(
            f"| {seen.rig} | {seen.fault.name}, {seen.fault.seconds:g} s | {', '.join(states)} | {detected} | {recovered} "
            f"| {seen.lost} | {seen.worst_deg:.2f} | {seen.stale} |"
        )
    return "\n".join(lines) + "\n"
