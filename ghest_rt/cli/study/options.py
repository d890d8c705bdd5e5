"""Options that the studies share."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ghest_rt.cli.options import MOVEMENTS, Method, Movement, Sensor
from ghest_rt.errors import BadInputError

if TYPE_CHECKING:
    from ghest_rt.studies.movements import Movements as MovementsPlayed
    from ghest_rt.studies.observing.scenario import SensorName
    from ghest_rt.vision.station import Method as MethodName

Movements = Annotated[
    list[Movement] | None,
    typer.Option(
        "--movement",
        help="Only this movement of Table 2; again for more. By default all four",
        show_default=False,
        case_sensitive=False,
        metavar=MOVEMENTS,
    ),
]
Methods = Annotated[
    list[Method] | None,
    typer.Option("--method", help="Only this method; again for more. By default paper, refined and fused", show_default=False),
]
Motions = Annotated[
    list[Path] | None,
    typer.Option(
        "--motion",
        metavar="FILE",
        help="OpenSim motion file (.mot) of a shoulder instead of the paper's movements; again for more",
        show_default=False,
    ),
]
Sensors = Annotated[
    list[Sensor] | None,
    typer.Option(
        "--sensor",
        help="Which sensor; again for more. By default the paper's",
        show_default=False,
    ),
]
Seeds = Annotated[
    int | None,
    typer.Option(
        "--seeds",
        min=1,
        metavar="N",
        help="Repeat with so many seeds. By default 1",
        show_default=False,
    ),
]
Seed = Annotated[int, typer.Option("--seed", min=0, metavar="N", help="Of the simulation")]
Out = Annotated[
    Path,
    typer.Option(
        metavar="FOLDER", help="Results, and what is done so far: the same command again goes on where it was interrupted"
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(min=1, metavar="N", help="Processes on this machine; by default one per core", show_default=False),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Run on a Dask cluster instead: its scheduler, such as tcp://node1:8786 (extra 'cluster')",
        show_default=False,
    ),
]
Duration = Annotated[
    float | None,
    typer.Option("--duration", min=0.1, metavar="SECONDS", help="Only the first seconds of every movement", show_default=False),
]


def chosen_methods(methods: list[Method] | None) -> "tuple[MethodName, ...]":
    """Return the methods to be judged.

    Raises:
        BadInputError: One of them looks for other markers.
    """
    from ghest_rt.studies.movements import METHODS

    if Method.ARUCO in (methods or ()):
        raise BadInputError("--method aruco: needs other markers in the scene; `ghest-rt study compare` has it")
    return tuple(dict.fromkeys(method.value for method in methods)) if methods else METHODS


def chosen_sensors(sensors: list[Sensor] | None, default: "tuple[SensorName, ...]" = ("paper",)) -> "tuple[SensorName, ...]":
    """Return the sensors, each once."""
    return tuple(dict.fromkeys(sensor.value for sensor in sensors)) if sensors else default


def movements_of(
    movement: list[Movement] | None,
    motion: list[Path] | None,
    duration: float | None,
    small: "MovementsPlayed | None" = None,
) -> "MovementsPlayed":
    """Return the movements to be played.

    Args:
        movement: `--movement`.
        motion: `--motion`.
        duration: `--duration`.
        small: With `--quick`, what is played unless named otherwise.

    Raises:
        BadInputError: The duration is none.
    """
    from ghest_rt.studies.movements import Movements as Played

    if duration is not None and not math.isfinite(duration):
        raise BadInputError(f"--duration {duration}: give a number of seconds; without --duration whole movements are played")
    named = Played(tuple(m.value for m in movement or ()), tuple(motion or ()), duration)
    return named if small is None else named.or_else(small)
