"""`ghest-rt study accuracy`: Tables 5 and 6 and Figure 13."""

from pathlib import Path
from typing import Annotated

import typer

from ghest_rt.cli.options import Method, Sensor
from ghest_rt.cli.study.options import Duration, Json, Motions, Movements, Out, Quick, Scheduler, Workers


def accuracy(
    out: Out = Path("out/study"),
    sensor: Annotated[list[Sensor] | None, typer.Option(help="Only this sensor; again for more", show_default=False)] = None,
    method: Annotated[
        list[Method] | None,
        typer.Option(help="Only this method; again for more. By default paper, refined and fused", show_default=False),
    ] = None,
    movement: Movements = None,
    motion: Motions = None,
    seeds: Annotated[int, typer.Option(min=1, metavar="N", help="Repeat with so many seeds, for confidence intervals")] = 3,
    duration: Duration = None,
    quick: Quick = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """Errors of the markers' and the arm's pose per movement: Tables 5 and 6, Figure 13."""
