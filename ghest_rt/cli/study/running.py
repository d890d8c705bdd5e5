"""What every study does on the command line: choose where to run, show progress, print what was found."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from ghest_rt.cli.console import print_json, printing
from ghest_rt.studies.engine.cluster import ClusterExecutor
from ghest_rt.studies.engine.local import LocalExecutor
from ghest_rt.studies.engine.run import Executor
from ghest_rt.studies.engine.store import ResultStore

_NUMBER_WIDTH = 6


def opened(out: Path, workers: int | None, scheduler: str | None) -> tuple[ResultStore, Executor]:
    """Return where tasks' results are kept, below the results folder and common to all studies in it, and what runs the tasks.

    That is a Dask cluster if its scheduler is named, otherwise this machine's cores.

    Raises:
        BadInputError: The folder cannot be written to, or the scheduler's address is none.
    """
    executor = LocalExecutor(workers) if scheduler is None else ClusterExecutor(scheduler)
    store = ResultStore(out / "tasks")
    store.prepare()
    return store, executor


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


def finish(document: dict[str, Any], out: Path, as_json: bool, show: Callable[[dict[str, Any], Console], None]) -> None:
    """Print a study's summary as JSON, or as the study shows it with the place of its files."""
    if as_json:
        print_json(document)
        return
    with printing():
        console = Console()
        show(document, console)
        console.print(f"Tables, summary and figures: {out / document['study']}", markup=False)


def new_table(title: str, texts: Sequence[str], numbers: Sequence[str]) -> Table:
    """Return an empty table: columns of texts first, then columns of numbers, whose titles wrap where there is little room."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    for column in texts:
        table.add_column(column, no_wrap=True)
    for column in numbers:
        table.add_column(column, justify="right", min_width=_NUMBER_WIDTH)
    return table


def show_checks(document: Mapping[str, Any], console: Console) -> None:
    """Print the paper's statements with their verdicts, and what the study cost."""
    for check in document["checks"]:
        verdict = {True: "[green]holds[/]", False: "[yellow]does not hold[/]"}.get(check["holds"], "[dim]not judged[/]")
        console.print(f"{verdict}: ", end="")
        console.print(check["name"], markup=False, highlight=False)
        console.print(f"  {check['evidence']}", markup=False, highlight=False, style="dim")
        console.print(f"  {check['explanation']}", markup=False, highlight=False, style="dim")
    console.print(f"Processor time, interrupted runs included: {document['cpu_s'] / 60:.1f} min")
