"""Injects every fault into a running service and measures what the subscriber sees.

`python -m tests.hil.faults [--out docs/faults.md]` prints the table, and writes it into the document.
"""

import argparse
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from tests.hil.rig import FIXTURES, Rig, Sample, fixture_rig

BOTH = ("realsense-serial", "oak-can")
WRONG_DEG = 2.0  # an angle further off than this is not the truth of its instant
_SETTLED = 20  # valid samples in a row
_RECOVERY_S = 15.0
_MARKER = "<!-- table -->"


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


def _fault(name: str, devices: str, mode: str, *reasons: str, seconds: float = 1.0, rigs: tuple[str, ...] = BOTH) -> Fault:
    return Fault(name, tuple(devices.split()), mode, frozenset(reasons), seconds, rigs)


FAULTS = (
    _fault("every other frame dropped (r0)", "r0", "drops"),
    _fault("frames in bursts of 15 (r1)", "r1", "bursts", "r1_no_frames"),
    _fault("frozen image (r0)", "r0", "frozen", "r0_no_frames"),
    _fault("frozen image (r1)", "r1", "frozen", "r1_no_frames"),
    _fault("cameras swapped", "r0 r1", "swapped", "m0_not_seen", "m1_not_seen"),
    _fault("camera silent (r0)", "r0", "silent", "r0_no_frames", seconds=1.5),
    _fault("camera lost and back (r1)", "r1", "unplugged", "r1_no_frames", seconds=2.0),
    _fault("both cameras lost and back", "r0 r1", "unplugged", "r0_no_frames", "r1_no_frames", seconds=2.0),
    _fault("encoders silent", "encoders", "silent", "encoders_silent", seconds=1.5),
    _fault("encoders: garbage", "encoders", "garbage", "encoders_silent"),
    _fault("encoders: checksum errors", "encoders", "crc_errors", "encoders_silent"),
    _fault("encoders: counter jumps", "encoders", "counter_jumps"),
    _fault("encoders: clock steps by 7 s and back", "encoders", "clock_step"),
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
        detected_ms: From its beginning to the first sample that is not plainly valid; None if there was none.
        recovered_ms: From its end to the first of the valid samples that follow one another; None: never.
        stale: Samples called valid whose angles are not the truth of their instant.
        worst_deg: The largest error among the samples with angles.
        missing: Samples that never came.
    """

    rig: str
    fault: Fault
    samples: int
    states: Counter[tuple[str, str]]
    detected_ms: float | None
    recovered_ms: float | None
    stale: int
    worst_deg: float
    missing: int

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
    well = rig.wait_valid(_SETTLED, _RECOVERY_S)
    seen = rig.subscriber.between(window.from_ns, time.monotonic_ns())
    first_bad = next((sample for sample in seen if not sample.valid), None)
    recovered_ns = _recovered_ns(seen, window.until_ns) if well else None
    errors = [(sample.valid, _error_deg(rig, sample)) for sample in seen if sample.body["quaternion_wxyz"] is not None]
    numbers = [sample.body["seq"] for sample in seen]
    return Seen(
        rig=rig.name,
        fault=fault,
        samples=len(seen),
        states=Counter((sample.body["status"], sample.body["reason"]) for sample in seen),
        detected_ms=None if first_bad is None else (first_bad.body["t_publish_ns"] - window.from_ns) * 1e-6,
        recovered_ms=None if recovered_ns is None else max(recovered_ns - window.until_ns, 0) * 1e-6,
        stale=sum(valid and error > WRONG_DEG for valid, error in errors),
        worst_deg=max((error for _, error in errors), default=0.0),
        missing=numbers[-1] - numbers[0] + 1 - len(numbers) if numbers else 0,
    )


def _recovered_ns(seen: list[Sample], until_ns: int) -> int | None:
    """Return when the samples became valid for good: `until_ns` if they were all along."""
    last_bad = max((k for k, sample in enumerate(seen) if not sample.valid), default=-1)
    if last_bad < 0:
        return until_ns
    return int(seen[last_bad + 1].body["t_publish_ns"]) if last_bad + 1 < len(seen) else None


def _error_deg(rig: Rig, sample: Sample) -> float:
    if rig.scene is None:
        raise ValueError("there is no truth on a real station")
    return rig.scene.error_deg(sample.body["t_sample_ns"], sample.body["quaternion_wxyz"])


def measure_all(name: str, folder: Path) -> list[Seen]:
    """Run the service on fixtures and go through its faults one after the other."""
    with fixture_rig(name, folder) as rig:
        return [measure(rig, fault) for fault in FAULTS if name in fault.rigs]


def table(results: list[Seen]) -> str:
    """Return the results as a Markdown table."""
    lines = [
        "| fixtures | fault | the subscriber sees | detected in (ms) | recovered in (ms) | worst error (°) | stale as fresh |",
        "|---|---|---|---|---|---|---|",
    ]
    for seen in results:
        states = [
            f"{status} ({reason})" if reason != "none" else status for (status, reason), n in seen.states.most_common() if n > 2
        ]
        detected = "–" if seen.detected_ms is None else f"{seen.detected_ms:.0f}"
        recovered = "never" if seen.recovered_ms is None else f"{seen.recovered_ms:.0f}"
        lines.append(
            f"| {seen.rig} | {seen.fault.name}, {seen.fault.seconds:g} s | {', '.join(states)} | {detected} | {recovered} "
            f"| {seen.worst_deg:.2f} | {seen.stale} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure on all fixtures, print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="document whose table is replaced, below the line that marks its place")
    parser.add_argument("--rig", choices=FIXTURES, action="append", help="only these fixtures")
    arguments = parser.parse_args()
    results: list[Seen] = []
    with tempfile.TemporaryDirectory(prefix="hil-") as folder:
        for name in arguments.rig or FIXTURES:
            results += measure_all(name, Path(folder))
    text = table(results)
    sys.stdout.write(text)
    if arguments.out is not None:
        head, marker, _ = arguments.out.read_text().partition(_MARKER)
        arguments.out.write_text(f"{head}{marker or _MARKER}\n\n{text}")
    sys.exit(1 if sum(seen.stale for seen in results) else 0)


if __name__ == "__main__":
    main()
