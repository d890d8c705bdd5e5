"""Recording in a process of its own, and what of it can be read afterwards."""

import subprocess
import sys
from pathlib import Path

from ghest_drivers.samples import EncoderSample, RgbdFrame
from ghest_rt.recording.reader import Recording

RATE_HZ = 100
FEEDER = (sys.executable, "-m", "tests.recording_live.feeder")
ROOT = Path(__file__).parents[2]


def feed_until_killed(folder: Path, *arguments: str, at: int) -> int:
    """Record, kill the process (SIGKILL) at a sample, and return the number of the last one that it had handed over."""
    feeder = subprocess.Popen([*FEEDER, folder, *arguments], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    assert feeder.stdout is not None
    last = 0
    for line in feeder.stdout:
        last = int(line)
        if last >= at:
            break
    feeder.kill()
    last = max([last, *(int(line) for line in feeder.stdout if line.endswith("\n"))])
    feeder.wait(10)
    feeder.stdout.close()
    return last


def newest(recording: Recording) -> dict[str, int]:
    """Number of the newest sample of each input, all before it being there too."""
    seqs: dict[str, list[int]] = {}
    for event in recording.events():
        if isinstance(event, RgbdFrame):
            seqs.setdefault(event.info.name, []).append(event.seq)
        elif isinstance(event, EncoderSample):
            seqs.setdefault("encoders", []).append(event.seq)
    assert set(seqs) == {"r0", "r1", "encoders"}
    assert all(found == list(range(len(found))) for found in seqs.values())
    return {name: found[-1] for name, found in seqs.items()}
