"""Runs the service for long and watches what must not grow: `python -m tests.chaos.soak --minutes 30 --out soak.png`.

The service runs on simulated devices in real time, as in the clinic: time is not accelerated, since pacing and threads are
what is looked at. What is accelerated is bad luck: with `--faults`, a device fails every ten seconds, so that what a
reconnection leaks shows. Resident memory, descriptors and threads are read from /proc, lateness from `health`.
Exit code 1 if memory, descriptors or threads grow, or a stale angle passed for a fresh one.
"""

import argparse
import json
import random
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from tests.hil.faults import FAULTS, WRONG_DEG
from tests.hil.rig import Rig, fixture_rig

RIG = "realsense-serial"
_WARM_UP_SHARE = 0.2  # caches fill, the second freeze of the garbage collector comes
_FAULT_EVERY_S = 10.0
_MB_PER_HOUR = 20.0


@dataclass(slots=True)
class Reading:
    """One second of the service.

    Attributes:
        t_s: Since the beginning.
        memory_mb: Resident memory of the main process.
        children_mb: Of the camera processes together.
        threads: Of the main process.
        files: Its descriptors.
        p99_ms: Lateness over the last 4,096 ticks.
        max_ms: Likewise the largest.
        valid: Share of the second's samples that were valid.
        fault: What was injected then, or "".
    """

    t_s: float
    memory_mb: float
    children_mb: float
    threads: int
    files: int
    p99_ms: float
    max_ms: float
    valid: float
    fault: str


def soak(minutes: float, with_faults: bool, progress: Progress) -> tuple[list[Reading], dict[str, Any]]:
    """Run and return readings, and what they come to."""
    choose = random.Random(1)
    readings: list[Reading] = []
    numbers: list[int] = []
    stale = 0
    with tempfile.TemporaryDirectory(prefix="soak-") as folder, fixture_rig(RIG, Path(folder)) as rig:
        start_s = time.monotonic()
        task = progress.add_task("soak", total=minutes * 60)
        fault_due_s, fault = _FAULT_EVERY_S, ""
        while (t_s := time.monotonic() - start_s) < minutes * 60:
            time.sleep(max(start_s + len(readings) + 1 - time.monotonic(), 0.0))
            fault = ""
            if with_faults and t_s >= fault_due_s:
                fault_due_s += _FAULT_EVERY_S
                one = choose.choice([one for one in FAULTS if RIG in one.rigs])
                rig.inject(one.devices, one.mode, one.seconds)
                fault = one.name
            fresh = rig.subscriber.take_angles()
            numbers += [sample.body["seq"] for sample in fresh]
            stale += sum(_is_stale(rig, sample) for sample in fresh)
            readings.append(_read(rig, t_s, fault, float(np.mean([sample.valid for sample in fresh])) if fresh else 0.0))
            progress.update(task, completed=t_s)
        health = rig.subscriber.healths[-1].body
    return readings, {
        "minutes": round(minutes, 2),
        "faults_injected": sum(bool(reading.fault) for reading in readings),
        "samples": len(numbers),
        "samples_missing": numbers[-1] - numbers[0] + 1 - len(numbers),
        "stale_as_fresh": stale,
        "valid_share": round(float(np.mean([reading.valid for reading in readings])), 4),
        "missed_ticks": health["missed_ticks"],
        "reopened": {name: item["reopened"] for name, item in health["inputs"].items()},
        "lateness_us": health["lateness"],
        "collection_ms": round(health["collection_ms"], 3),
        "major_faults": health["major_faults"],
        **_growth(readings),
    }


def _is_stale(rig: Rig, sample: Any) -> bool:
    if not sample.valid or rig.scene is None:
        return False
    return rig.scene.error_deg(sample.body["t_sample_ns"], sample.body["quaternion_wxyz"]) > WRONG_DEG


def _read(rig: Rig, t_s: float, fault: str, valid: float) -> Reading:
    pid = rig.service.pid
    late = rig.subscriber.healths[-1].body["lateness_recent"] if rig.subscriber.healths else {"p99_us": 0.0, "max_us": 0.0}
    return Reading(
        t_s=t_s,
        memory_mb=_resident_mb(pid),
        children_mb=sum(_resident_mb(child) for child in _children(pid)),
        threads=_entries(f"/proc/{pid}/task"),
        files=_entries(f"/proc/{pid}/fd"),
        p99_ms=late["p99_us"] / 1000,
        max_ms=late["max_us"] / 1000,
        valid=valid,
        fault=fault,
    )


def _resident_mb(pid: int) -> float:
    try:
        lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS:")), 0.0)


def _children(pid: int) -> list[int]:
    found: list[int] = []
    for task in Path(f"/proc/{pid}/task").glob("*/children"):
        try:
            found += [int(child) for child in task.read_text().split()]
        except OSError:
            continue
    return found


def _entries(folder: str) -> int:
    return sum(1 for _ in Path(folder).iterdir())


def _growth(readings: list[Reading]) -> dict[str, Any]:
    """Return memory's slope after the warm-up, and descriptors and threads then (median of a tenth) and at the end."""
    warm = readings[int(len(readings) * _WARM_UP_SHARE) :]
    tenth = max(len(warm) // 10, 1)
    hours = np.array([reading.t_s for reading in warm]) / 3600
    return {
        "memory_mb": {"after_warm_up": round(warm[0].memory_mb, 1), "end": round(warm[-1].memory_mb, 1)},
        "memory_mb_per_hour": round(float(np.polyfit(hours, [reading.memory_mb for reading in warm], 1)[0]), 2),
        **{
            name: {
                "after_warm_up": float(np.median([getattr(reading, name) for reading in warm[:tenth]])),
                "end": float(np.median([getattr(reading, name) for reading in warm[-tenth:]])),
            }
            for name in ("files", "threads")
        },
    }


def problems(report: dict[str, Any]) -> list[str]:
    """Say what grows, or is wrong."""
    found = [f"{name} grow" for name in ("files", "threads") if report[name]["end"] > report[name]["after_warm_up"] + 2]
    if report["memory_mb_per_hour"] > _MB_PER_HOUR:
        found.append(f"memory grows by {report['memory_mb_per_hour']} MB an hour")
    return found + [f"{report['stale_as_fresh']} stale angles passed for fresh"] * bool(report["stale_as_fresh"])


def draw(readings: list[Reading], report: dict[str, Any], path: Path) -> None:
    """Draw what was watched (needs the extra `plots`)."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    minutes = np.array([reading.t_s for reading in readings]) / 60
    figure, (memory, handles, late, valid) = plt.subplots(4, 1, figsize=(9, 8.5), sharex=True, layout="constrained")
    memory.plot(minutes, [reading.memory_mb for reading in readings], color="#0072B2", label="service")
    memory.plot(minutes, [reading.children_mb for reading in readings], color="#999999", lw=0.8, label="camera processes")
    memory.set(ylabel="resident (MB)", ylim=(0, None))
    handles.plot(minutes, [reading.files for reading in readings], color="#D55E00", label="descriptors")
    handles.plot(minutes, [reading.threads for reading in readings], color="#009E73", label="threads")
    handles.set(ylabel="count", ylim=(0, None))
    late.semilogy(minutes, [max(reading.max_ms, 0.01) for reading in readings], color="#CC79A7", label="largest")
    late.semilogy(minutes, [max(reading.p99_ms, 0.01) for reading in readings], color="#0072B2", label="p99")
    late.axhline(1000 / 66.6, color="black", lw=0.8, ls=":", label="a period")
    late.set(ylabel="late, last 4,096\nticks (ms)")
    valid.plot(minutes, [100 * reading.valid for reading in readings], color="#009E73", lw=0.8, label="valid samples")
    struck = [reading.t_s / 60 for reading in readings if reading.fault]
    valid.plot(struck, [0.0] * len(struck), "|", color="#D55E00", label="a device fails")
    valid.set(ylabel="share of each\nsecond (%)", ylim=(-5, 105), xlabel="minutes")
    for axes in (memory, handles, late, valid):
        axes.grid(alpha=0.3)
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, fontsize=8, frameon=False)
    figure.suptitle(
        f"{report['minutes']:g} min, {report['samples']} samples, {report['faults_injected']} device faults: "
        f"memory {report['memory_mb_per_hour']:+.1f} MB/h, {report['stale_as_fresh'] or 'no'} stale samples published as fresh"
    )
    figure.savefig(path, dpi=130)
    plt.close(figure)


def main() -> None:
    """Run, print a JSON document, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--faults", action="store_true", help="let a device fail every ten seconds")
    parser.add_argument("--out", type=Path, help="picture to write (.png)")
    parser.add_argument("--readings", type=Path, help="every second's reading as JSON")
    arguments = parser.parse_args()
    with Progress(console=Console(stderr=True)) as progress:
        readings, report = soak(arguments.minutes, arguments.faults, progress)
    sys.stdout.write(json.dumps(report, indent=2) + "\n")
    if arguments.readings is not None:
        arguments.readings.write_text(json.dumps([asdict(reading) for reading in readings]))
    if arguments.out is not None:
        draw(readings, report, arguments.out)
    found = problems(report)
    sys.stderr.writelines(f"{line}\n" for line in found)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
