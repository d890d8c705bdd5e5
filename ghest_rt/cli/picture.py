"""`ghest-rt picture`: one look at a recording."""

from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from ghest_rt.cli.console import printing
from ghest_rt.cli.options import Method
from ghest_rt.studies.picture import draw_recording


def draw(recording: Path, out: Path, method: Method | None) -> None:
    """Draw a recording, showing how far it has got.

    Raises:
        BadInputError: The recording or the output file cannot be used.
        GhestError: Matplotlib is not installed.
    """
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        task = progress.add_task(f"estimating {recording.name}", total=1.0)
        draw_recording(
            recording,
            out,
            None if method is None else method.value,
            progress=lambda share: progress.update(task, completed=share),
        )
    with printing():
        Console().print(f"{out}: picture of {recording.name}")
