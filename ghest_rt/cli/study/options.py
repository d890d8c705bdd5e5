"""Options that the studies share."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ghest_rt.cli.options import MOVEMENTS, Method, Movement
from ghest_rt.errors import BadInputError

if TYPE_CHECKING:
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
Quick = Annotated[bool, typer.Option("--quick", metavar="", help="A small version of the study, to see that it works")]


def chosen_methods(methods: list[Method] | None) -> "tuple[MethodName, ...]":
    """Return the methods to be judged.

    Raises:
        BadInputError: One of them looks for other markers.
    """
    from ghest_rt.studies.movements import METHODS

    if Method.ARUCO in (methods or ()):
        raise BadInputError("--method aruco: needs other markers in the scene; `ghest-rt study compare` has it")
    return tuple(dict.fromkeys(method.value for method in methods)) if methods else METHODS
