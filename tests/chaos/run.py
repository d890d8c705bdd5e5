"""Puts a running service through every fault and tells what a subscriber saw.

`python -m tests.chaos.run [--out docs/faults.md]`: those of its devices first (`tests.hil.faults`, on both kinds of fixtures),
then those of everything else (`tests.chaos.faults`). Exit code 1 if a stale angle passed for a fresh one, or if it took more
than 3 s from the end of a fault until valid angles were back.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from tests.chaos.faults import CHAOS, RECOVERY_MS, Chaos, measure
from tests.chaos.rig import chaos_rig
from tests.chaos.wall_clock import compiler
from tests.hil.faults import FAULTS, Seen, table
from tests.hil.faults import measure as measure_device_fault
from tests.hil.rig import FIXTURES, fixture_rig

MARKER = "<!-- table -->"
RIGS: dict[str, dict[str, Any]] = {
    "plain": {},
    "wall clock": {"own_wall_clock": True},
    "recording": {"record": True},
    "routed": {"routed": True},
}


def device_faults(folder: Path, names: tuple[str, ...] = FIXTURES) -> Iterator[Seen]:
    """Run the service on fixtures and go through what devices do, one after the other."""
    for name in names:
        with fixture_rig(name, folder) as rig:
            yield from (measure_device_fault(rig, fault) for fault in FAULTS if name in fault.rigs)


def whole_service_faults(folder: Path, chaos: tuple[Chaos, ...] = CHAOS) -> Iterator[Seen]:
    """Go through what happens to the service itself; each kind of rig is started once."""
    for kind, settings in RIGS.items():
        wanted = [one for one in chaos if one.rig == kind]
        if not wanted or (kind == "wall clock" and compiler() is None):
            continue
        with chaos_rig(folder, **settings) as rig:
            yield from (measure(rig, one) for one in wanted)


def broken_promises(results: list[Seen]) -> list[str]:
    """Say what was promised and not kept."""
    broken = [f"{seen.rig}: {seen.fault.name}: {seen.stale} stale angles passed for fresh" for seen in results if seen.stale]
    for seen in results:
        if seen.recovered_ms is None or seen.recovered_ms > RECOVERY_MS:
            took = "never" if seen.recovered_ms is None else f"in {seen.recovered_ms:.0f} ms"
            broken.append(f"{seen.rig}: {seen.fault.name}: recovered {took}, not within {RECOVERY_MS:.0f} ms")
    return broken


def main() -> None:
    """Measure, print, and write the table into a document."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, help="document whose table is replaced, below the line that marks its place")
    parser.add_argument("--only", choices=("devices", "service"), help="half of it")
    arguments = parser.parse_args()
    results: list[Seen] = []
    counts = {"devices": sum(len(fault.rigs) for fault in FAULTS), "service": len(CHAOS)}
    total = counts.get(arguments.only) or sum(counts.values())
    load = [os.getloadavg()[0]]
    with tempfile.TemporaryDirectory(prefix="chaos-") as folder, Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task("faults", total=total)
        for wanted, faults in (("devices", device_faults), ("service", whole_service_faults)):
            if arguments.only in (None, wanted):
                for seen in faults(Path(folder)):
                    results.append(seen)
                    load.append(os.getloadavg()[0])
                    progress.update(task, advance=1, description=seen.fault.name[:50])
    machine = f"{os.cpu_count()} cores, load average {min(load):.1f} to {max(load):.1f}"
    text = f"{table(results)}\nMeasured on {machine}: the simulated devices run on the same cores.\n"
    sys.stdout.write(text)
    if arguments.out is not None:
        head, marker, _ = arguments.out.read_text().partition(MARKER)
        arguments.out.write_text(f"{head}{marker or MARKER}\n\n{text}")
    broken = broken_promises(results)
    sys.stderr.writelines(f"{line}\n" for line in broken)
    sys.exit(1 if broken else 0)


if __name__ == "__main__":
    main()
