"""Size of the base install and time of `ghest-rt --help`, in a fresh virtual environment."""

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

_ROOT = Path(__file__).resolve().parents[1]


def run(quick: bool) -> dict[str, Any]:
    """Install the base package into a new environment and measure it (pip and setuptools themselves not counted)."""
    with tempfile.TemporaryDirectory() as folder:
        environment = Path(folder) / "venv"
        subprocess.run([sys.executable, "-m", "venv", str(environment)], check=True)
        subprocess.run([str(environment / "bin" / "pip"), "install", "--quiet", str(_ROOT)], check=True)
        packages = next((environment / "lib").glob("python*/site-packages"))
        tools = ("pip", "setuptools", "pkg_resources", "_distutils_hack")
        total = sum(
            file.stat().st_size
            for file in packages.rglob("*")
            if file.is_file() and not file.relative_to(packages).parts[0].startswith(tools)
        )
        seconds = []
        for _ in range(3 if quick else 9):
            start = time.perf_counter()
            subprocess.run([str(environment / "bin" / "ghest-rt"), "--help"], check=True, stdout=subprocess.DEVNULL)
            seconds.append(time.perf_counter() - start)
    return {"site_packages_mb": round(total / 1e6, 1), "help_s_median": round(sorted(seconds)[len(seconds) // 2], 3)}
