"""`ghest-rt study sensitivity`: equations (11)-(13), Tables 3-4, Figures 14-17, and beyond."""

from pathlib import Path
from typing import Annotated

import typer

from ghest_rt.cli.options import Method, Sensor
from ghest_rt.cli.study.options import Duration, Json, Motions, Movements, Out, Quick, Scheduler, Workers


def sensitivity(
    out: Out = Path("out/study"),
    sensor: Annotated[Sensor, typer.Option(help="Which sensor")] = Sensor.PAPER,
    method: Annotated[
        list[Method] | None,
        typer.Option(help="Only this method; again for more. By default paper, refined and fused", show_default=False),
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
    """Errors and relative sensitivities as markers shift (Figures 14-17), turn, and as the calibration is wrong."""
