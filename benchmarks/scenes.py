"""The recordings that the benchmarks run on: simulated once, kept in out/benchmarks/."""

import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[1] / "out" / "benchmarks"


def scene(sensor: str, marker: str, duration_s: float) -> Path:
    """Return a COMB recording of the sensor and marker texture asked for, simulating it if it is not there yet.

    The same seed gives the same poses, light and noise whatever the marker's texture.
    """
    path = FOLDER / f"{sensor}-{marker}-{duration_s:g}s.mcap"
    if not path.exists():
        FOLDER.mkdir(parents=True, exist_ok=True)
        command = [str(Path(sys.executable).with_name("ghest-rt")), "simulate", "--movement", "COMB", "--sensor", sensor]
        command += ["--marker", marker, "--seed", "1", "--duration", str(duration_s), "--out", str(path)]
        subprocess.run(command, check=True)
    return path
