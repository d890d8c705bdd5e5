"""`ghest-rt simulate`: a recording of a simulated patient. Needs the extra `sim` as soon as it is imported."""

from dataclasses import asdict

from rich.console import Console
from rich.progress import Progress

from ghest_rt.cli.console import print_json, printing
from ghest_rt.cli.simulated_station import checked_station
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.options import SimulateOptions


def simulate_recording(options: SimulateOptions, as_json: bool) -> None:
    """Simulate, record, and say what was recorded.

    Raises:
        BadInputError: An option, the station file, the motion file or the output path cannot be used.
        GhestError: The exoskeleton cannot follow the movement, or the disk or standard output is full.
    """
    if options.station is not None:
        checked_station(options.station)
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        task = progress.add_task(f"simulating {options.out.name}", total=1.0)
        try:
            summary = simulate(options, lambda share: progress.update(task, completed=share))
        except KeyboardInterrupt:
            console.print(f"{options.out}: interrupted; nothing of it is left", markup=False, highlight=False)
            raise
    if as_json:
        print_json({**asdict(summary), "out": str(summary.out)})
        return
    frames = ", ".join(f"{number} frames of {name}" for name, number in summary.frames.items())
    with printing():
        Console().print(
            f"{summary.out}: {summary.motion}, {summary.duration_s:.2f} s, {frames}, "
            f"{summary.encoder_samples} encoder samples, {summary.size_bytes / 1e6:.1f} MB",
            soft_wrap=True,
            highlight=False,
        )
