"""`ghest-rt score`: how far the estimates are from the truth."""

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from statistics import fmean

from rich import box
from rich.console import Console
from rich.progress import Progress, TaskID
from rich.table import Table

from ghest_rt.cli.console import print_json, printing
from ghest_rt.cli.options import Method
from ghest_rt.cli.unused_words import unused_in_words
from ghest_rt.recording.reader import files_of
from ghest_rt.studies.score import RecordingScore, score_recording


def score_paths(paths: Sequence[Path], method: Method | None, as_json: bool) -> None:
    """Score recordings, and all those of folders, and print a table or one JSON document.

    Raises:
        BadInputError: A path holds no recording, or one without truth or any angles to compare with it.
        GhestError: Standard output is full.
    """
    files = [file for path in paths for file in files_of(path)]
    console = Console(stderr=True)
    scores: list[RecordingScore] = []
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        for file in files:
            task = progress.add_task(file.name, total=1.0)
            show = partial(_show, progress, task)
            scores.append(score_recording(file, None if method is None else method.value, progress=show))
            progress.remove_task(task)
    if as_json:
        print_json({"recordings": [asdict(score) for score in scores], "mean": _mean(scores)})
    else:
        with printing():
            _print_table(scores)


def _show(progress: Progress, task: TaskID, share: float) -> None:
    progress.update(task, completed=share)


def _mean(scores: Sequence[RecordingScore]) -> dict[str, float]:
    """The paper's last column: the mean over movements."""
    return {
        "orientation_rmse_deg": fmean(score.orientation_rmse_deg for score in scores),
        "position_rmse_m": fmean(score.position_rmse_m for score in scores),
        "m0_rmse_m": fmean(score.m0_rmse_m for score in scores),
        "m1_rmse_m": fmean(score.m1_rmse_m for score in scores),
        "published_orientation_rmse_deg": fmean(score.published_orientation_rmse_deg for score in scores),
        "angles_fraction": fmean(score.angles_fraction for score in scores),
        "valid_fraction": fmean(score.valid_fraction for score in scores),
    }


def _print_table(scores: Sequence[RecordingScore]) -> None:
    table = Table(
        title="Root mean square errors against the truth (the paper's metrics, 3.4.2)",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    table.add_column("recording", overflow="fold", min_width=10)
    for column in ("method", "arm\n°", "at publ.\n°", "arm\nmm", "m0\nmm", "m1\nmm", "angles\n%", "valid\n%"):
        table.add_column(column, justify="right", no_wrap=True)
    for score in scores:
        table.add_row(
            Path(score.recording).name,
            score.method,
            f"{score.orientation_rmse_deg:.4f}",
            f"{score.published_orientation_rmse_deg:.4f}",
            f"{score.position_rmse_m * 1000:.4f}",
            f"{score.m0_rmse_m * 1000:.4f}",
            f"{score.m1_rmse_m * 1000:.4f}",
            f"{100 * score.angles_fraction:.2f}",
            f"{100 * score.valid_fraction:.2f}",
        )
    if len(scores) > 1:
        mean = _mean(scores)
        table.add_section()
        table.add_row(
            "mean",
            "",
            f"{mean['orientation_rmse_deg']:.4f}",
            f"{mean['published_orientation_rmse_deg']:.4f}",
            f"{mean['position_rmse_m'] * 1000:.4f}",
            f"{mean['m0_rmse_m'] * 1000:.4f}",
            f"{mean['m1_rmse_m'] * 1000:.4f}",
            f"{100 * mean['angles_fraction']:.2f}",
            f"{100 * mean['valid_fraction']:.2f}",
        )
    console = Console()
    console.print(table)
    console.print("at publ.: against the truth when the sample is published, as long after its own instant as the method lags")
    console.print("angles: with angles, valid or degraded; the errors are theirs. Shares are of the samples after the start")
    for score in scores:
        if score.lost:
            lost = ", ".join(f"{reason} x{score.lost[reason]}" for reason in sorted(score.lost))
            console.print(f"{Path(score.recording).name}: lost: {lost}", style="yellow", markup=False)
        if score.elbow_flexion_rmse_deg is not None:
            console.print(f"{Path(score.recording).name}: elbow flexion {score.elbow_flexion_rmse_deg:.2f}°", markup=False)
        for line in score.skipped:
            console.print(f"{Path(score.recording).name}: {line}", style="yellow", markup=False)
        if score.unused:
            console.print(f"{Path(score.recording).name}: {unused_in_words(score.unused)}", markup=False)
