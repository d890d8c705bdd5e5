"""The live loop on a 128x128 recording at recorded pace: rate, lateness beside a bare `clock_nanosleep` loop, CPU, memory.

Each method in turn. The service runs in a process of its own and publishes on Zenoh to one subscriber, as in the clinic; the
bare loop runs at the same time on the same cores, so that both suffer the same machine.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.scenes import scene

_RATE_HZ = 66.6
_ENDPOINT = "tcp/127.0.0.1:17447"
_METHODS = ("refined", "fused")
_COMMAND = str(Path(sys.executable).with_name("ghest-rt"))


def run(quick: bool) -> dict[str, Any]:
    """Replay at recorded pace while a bare loop runs for 27 s (quick: 8 s), once with each method.

    All of the paper's COMB: no recording repeats itself, an arm that leaps back to the beginning has moved its markers.
    """
    seconds = 8.0 if quick else 27.0
    recording = scene("paper", "disks", 10.0 if quick else 30.0)
    return {method: _run_method(recording, method, seconds) for method in _METHODS}


def _run_method(recording: Path, method: str, seconds: float) -> dict[str, Any]:
    service = _start_service(recording, "--method", method, "--json")
    time.sleep(1.5)  # interpreter and imports
    cpu_before_s = _cpu_s(service.pid)
    listener = subprocess.Popen(
        [_COMMAND, "listen", "--connect", _ENDPOINT, "--json"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    bare = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("bare_loop.py")), str(seconds), str(_RATE_HZ)], stdout=subprocess.PIPE
    )
    late_us = np.array(json.loads(bare.communicate()[0]))
    cpu_s = _cpu_s(service.pid) - cpu_before_s
    report = json.loads(service.communicate()[0])["runs"][0]
    listener.terminate()
    listener.wait()
    bare_p50, bare_p99 = (round(float(v), 1) for v in np.percentile(late_us, (50, 99)))
    lateness = report["lateness"]
    return {
        "rate_hz": round(report["rate_hz"], 4),
        "missed_ticks": report["missed_ticks"],
        "skipped_frames": report["skipped_frames"],
        "valid_fraction": report["valid_fraction"],
        "lateness_us": {"p50": lateness["p50_us"], "p99": lateness["p99_us"], "p999": lateness["p999_us"]},
        "bare_clock_nanosleep_us": {"p50": bare_p50, "p99": bare_p99},
        "ratio_p99": round(lateness["p99_us"] / bare_p99, 2),
        "cpu_share_of_one_core": round(cpu_s / seconds, 3),
    }


def memory(quick: bool) -> dict[str, Any]:
    """Replay in a loop for 10 minutes (quick: 20 s) and watch the resident memory, once a second."""
    seconds = 20.0 if quick else 600.0
    service = _start_service(scene("paper", "disks", 10.0), "--loop", "--json")
    samples: list[float] = []
    start = time.monotonic()
    while time.monotonic() - start < seconds:
        time.sleep(1.0)
        samples.append(_resident_mb(service.pid))
    service.terminate()
    service.communicate(timeout=10)
    warm = samples[min(len(samples) // 10, 30) :]
    slope = float(np.polyfit(np.arange(len(warm)), warm, 1)[0]) * 60.0
    return {
        "seconds": seconds,
        "resident_mb_after_warm_up": round(warm[0], 1),
        "resident_mb_at_end": round(warm[-1], 1),
        "resident_mb_max": round(max(warm), 1),
        "growth_mb_per_min": round(slope, 3),
    }


def _start_service(recording: Path, *options: str) -> "subprocess.Popen[bytes]":
    command = [_COMMAND, "--replay", str(recording), "--listen", _ENDPOINT, *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _resident_mb(pid: int) -> float:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
