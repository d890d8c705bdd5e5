"""What every study does on the command line: check the installation, choose where to run, show progress."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from ghest_rt.studies.engine.cluster import ClusterExecutor
from ghest_rt.studies.engine.local import LocalExecutor
from ghest_rt.studies.engine.run import Executor
from ghest_rt.studies.engine.store import ResultStore


def executor(workers: int | None, scheduler: str | None) -> Executor:
    """Return what carries out the tasks: a Dask cluster if its scheduler is named, otherwise this machine's cores."""
    return LocalExecutor(workers) if scheduler is None else ClusterExecutor(scheduler)


def store_in(out: Path) -> ResultStore:
    """Return where tasks' results are kept, below the results folder and common to all studies in it.

    Raises:
        BadInputError: The folder cannot be written to.
    """
    store = ResultStore(out / "tasks")
    store.prepare()
    return store


@contextmanager
def shown_progress(title: str) -> Iterator[Callable[[float, float], None]]:
    """Show a bar with the time left on standard error, if that is a terminal; yields what to tell (done, total).

    An interruption says that nothing finished is lost.
    """
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(compact=True),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True, speed_estimate_period=600) as bar:
        task = bar.add_task(title, total=None)
        try:
            yield lambda done, total: bar.update(task, completed=done, total=total)
        except KeyboardInterrupt:
            console.print(
                f"{title}: interrupted; what is finished is kept, the same command goes on from here", highlight=False
            )
            raise


def show_end(console: Console, document: Mapping[str, Any], folder: Path) -> None:
    """Print the paper's statements with their verdicts, what the study cost and where its results are."""
    for check in document["checks"]:
        verdict = "[green]holds[/]" if check["holds"] else "[yellow]does not hold[/]"
        console.print(f"{verdict}: ", end="")
        console.print(check["name"], markup=False, highlight=False)
        console.print(f"  {check['evidence']}", markup=False, highlight=False, style="dim")
        console.print(f"  {check['explanation']}", markup=False, highlight=False, style="dim")
    console.print(f"Processor time, interrupted runs included: {document['cpu_s'] / 60:.1f} min")
    console.print(f"Tables, summary and figures: {folder}", markup=False)
