"""`ghest-rt study latency`: how far published angles are behind the arm."""

from pathlib import Path
from typing import Annotated, Any, cast

import typer

from ghest_rt.cli.options import Json, Sensor
from ghest_rt.cli.study.options import Duration, Motions, Movements, Out, Quick, Scheduler, Workers
from ghest_rt.extras import need_extra


def latency(
    out: Out = Path("out/study"),
    sensor: Annotated[Sensor, typer.Option(help="Which sensor")] = Sensor.PAPER,
    speed: Annotated[
        list[float] | None,
        typer.Option(
            min=0.1,
            max=5.0,
            metavar="FACTOR",
            help="Play at this speed; again for more. By default 0.5, 1, 2, 3",
            show_default=False,
        ),
    ] = None,
    movement: Movements = None,
    motion: Motions = None,
    seed: Annotated[int, typer.Option(metavar="N", help="Of the simulation")] = 1,
    duration: Duration = None,
    quick: Quick = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """Error at the instant of publishing against the speed of the movement, and the age of the inputs."""
    from ghest_rt.cli.study.running import executor, shown_progress, store_in

    need_extra("study", "a study")
    from ghest_rt.cli.console import print_json
    from ghest_rt.studies import movements as plan
    from ghest_rt.studies.figures.style import save_figure
    from ghest_rt.studies.latency import (
        COMPUTING_FRAMES,
        QUICK,
        QUICK_COMPUTING_FRAMES,
        QUICK_SPEEDS,
        SPEEDS,
        LatencySettings,
    )
    from ghest_rt.studies.latency import latency as run_latency
    from ghest_rt.studies.report.latency_figures import draw_latency
    from ghest_rt.studies.report.results import write_results

    names = tuple(m.value for m in movement or ())
    movements = plan.Movements(names, tuple(motion or ()), duration)
    settings = LatencySettings(
        movements=movements.or_else(QUICK) if quick else movements,
        speeds=tuple(speed or (QUICK_SPEEDS if quick else SPEEDS)),
        sensor=sensor.value,
        seed=seed,
        computing_frames=QUICK_COMPUTING_FRAMES if quick else COMPUTING_FRAMES,
    )
    with shown_progress("latency") as progress:
        summary = run_latency(settings, store_in(out), executor(workers, scheduler), progress)
    document = write_results(out, "latency", summary, cast(list[dict[str, object]], summary["rows"]))
    save_figure(draw_latency(document), out / "latency" / "figures", "latency")
    if as_json:
        print_json(document)
    else:
        _print(document, out / "latency")


def _print(summary: dict[str, Any], folder: Path) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console()
    candidates = summary["candidates"]
    table = Table(title="Answers when they are published", title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("method", no_wrap=True)
    for column in ("lag\nms", "image\nms old", "computing\nms", "behind\nms", "error\n° RMS"):
        table.add_column(column, justify="right", no_wrap=True)
    for who in candidates:
        age_ms = max(who["age_ms"][camera] or 0.0 for camera in ("r0", "r1"))
        computing_ms = who["vision_ms"] + who["answer_ms"]
        figures = (
            f"{who['lag_ms']:.0f}",
            f"{age_ms:.1f}",
            f"{computing_ms:.1f}",
            f"{who['effective_delay_ms']:.1f}",
            f"{who['published_deg']:.3f}",
        )
        table.add_row(who["title"], *figures)
    console.print(table)
    table = Table(title="Degrees RMS when published", title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("movement", no_wrap=True)
    for column in ("speed", "°/s RMS", *(who["title"].replace(", ", "\n") for who in candidates)):
        table.add_column(column, justify="right")
    rows = summary["rows"]
    for movement, speed in dict.fromkeys((row["movement"], row["speed"]) for row in rows):
        there = {row["candidate"]: row for row in rows if (row["movement"], row["speed"]) == (movement, speed)}
        errors = (f"{there[who['key']]['published_deg']:.3f}" for who in candidates)
        table.add_row(movement, f"{speed:g}", f"{there['fused']['rms_speed_dps']:.1f}", *errors)
    console.print(table)
    console.print(f"Tables, summary and figures: {folder}", markup=False)
