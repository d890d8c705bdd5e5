"""`ghest-rt study latency`: how far published angles are behind the arm."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ghest_rt.cli.options import Json, Sensor
from ghest_rt.cli.study.options import Motions, Movements, Out, Scheduler, Seed, Workers, movements_of
from ghest_rt.extras import need_extra

if TYPE_CHECKING:
    from rich.console import Console


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
    seed: Seed = 1,
    duration: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            metavar="SECONDS",
            help="How much of every movement, in its own time, from 0.5 s after its start. By default 8, with --quick 1.2",
            show_default=False,
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            metavar="",
            help="A small version, to see that it works: 1.2 s of COMB at two speeds; what is named counts",
        ),
    ] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """Error at the instant of publishing against the speed of the movement, and the age of the inputs."""
    from ghest_rt.cli.study.running import finish, opened, shown_progress

    need_extra("study", "a study")
    from ghest_rt.studies.figures.latency import figures
    from ghest_rt.studies.latency.study import (
        COMPUTING_FRAMES,
        QUICK,
        QUICK_COMPUTING_FRAMES,
        QUICK_SPEEDS,
        SPEEDS,
        LatencySettings,
    )
    from ghest_rt.studies.latency.study import latency as run_latency
    from ghest_rt.studies.results import write_study

    settings = LatencySettings(
        movements=movements_of(movement, motion, duration, QUICK if quick else None),
        speeds=tuple(dict.fromkeys(speed or (QUICK_SPEEDS if quick else SPEEDS))),
        sensor=sensor.value,
        seed=seed,
        computing_frames=QUICK_COMPUTING_FRAMES if quick else COMPUTING_FRAMES,
    )
    store, runs_on = opened(out, workers, scheduler)
    with shown_progress("study latency") as progress:
        summary = run_latency(settings, store, runs_on, progress)
    document = write_study(out, summary, {"rows": summary["rows"]}, figures(summary))
    finish(document, out, as_json, _show)


def _show(document: dict[str, Any], console: "Console") -> None:
    from ghest_rt.cli.study.running import new_table
    from ghest_rt.studies.numbers import number

    candidates, rows = document["candidates"], document["rows"]
    table = new_table(
        "Answers when they are published",
        ("method",),
        ("lag\nms", "image\nms old", "computing\nms", "behind\nms", "error\n° RMS"),
    )
    for who in candidates:
        table.add_row(
            who["title"],
            f"{who['lag_ms']:.0f}",
            number(max(who["age_ms"][camera] or 0.0 for camera in ("r0", "r1"))),
            number(who["vision_ms"] + who["answer_ms"]),
            number(who["effective_delay_ms"]),
            number(who["published_deg"]),
        )
    console.print(table)
    titles = (who["title"].replace(", ", "\n") for who in candidates)
    table = new_table("Degrees RMS when published", ("movement",), ("speed", "°/s RMS", *titles))
    for movement, speed in dict.fromkeys((row["movement"], row["speed"]) for row in rows):
        there = {row["candidate"]: row for row in rows if (row["movement"], row["speed"]) == (movement, speed)}
        errors = (number(there[who["key"]]["published_deg"]) for who in candidates)
        table.add_row(movement, f"{speed:g}", number(there["fused"]["rms_speed_dps"]), *errors)
    console.print(table)
