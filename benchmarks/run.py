"""Run the benchmarks and write a table and a plot: `python -m benchmarks.run [NAME…] [--quick]` from the project's root."""

import argparse
import json
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks import (
    bound,
    encoder_path,
    filter_tick,
    flood,
    footprint,
    imaging,
    loop,
    pose,
    recording,
    supervision,
    throughput,
    tick,
)
from benchmarks.plot import draw

_OUT = Path(__file__).resolve().parents[1] / "out" / "benchmarks"
_BENCHMARKS: dict[str, Callable[[bool], dict[str, Any]]] = {
    "pose": pose.run,
    "bound": bound.run,
    "imaging": imaging.run,
    "tick": tick.run,
    "filter": filter_tick.run,
    "throughput": throughput.run,
    "loop": loop.run,
    "flood": flood.run,
    "memory": loop.memory,
    "footprint": footprint.run,
    "encoders": encoder_path.run,
    "recording": recording.run,
    "supervision": supervision.run,
}


def main() -> None:
    """Run what was asked for (default: all); results of earlier runs of the others are kept in the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(_BENCHMARKS))
    parser.add_argument("--quick", action="store_true", help="shorter runs, rougher figures")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in _BENCHMARKS]
    if unknown:
        parser.error(f"no benchmark {', '.join(unknown)}; there are {', '.join(_BENCHMARKS)}")
    _OUT.mkdir(parents=True, exist_ok=True)
    console = Console()
    for name in arguments.names or _BENCHMARKS:
        with console.status(f"{name} …"):
            result = _BENCHMARKS[name](arguments.quick)
        result["machine"] = f"{platform.machine()}, Python {platform.python_version()}"
        (_OUT / f"{name}.json").write_text(json.dumps(result, indent=2) + "\n")
        console.print(f"[bold]{name}[/]")
        console.print_json(data=result)
    results = {name: json.loads(path.read_text()) for name in _BENCHMARKS if (path := _OUT / f"{name}.json").exists()}
    (_OUT / "table.md").write_text(_table(results))
    draw(results, _OUT / "benchmarks.png")
    console.print(f"table: {_OUT / 'table.md'}   plot: {_OUT / 'benchmarks.png'}")


def _table(results: dict[str, dict[str, Any]]) -> str:
    lines = ["| benchmark | what | figure |", "|---|---|---|"]
    for name, result in results.items():
        for key, value in result.items():
            figure = ", ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else value
            lines.append(f"| {name} | {key} | {figure} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
