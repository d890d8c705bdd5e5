"""Choices and repeated options offered on the command line."""

from enum import StrEnum
from typing import Annotated

import typer


class Method(StrEnum):
    """How markers are found and angles estimated."""

    PAPER = "paper"
    REFINED = "refined"
    PHOTOMETRIC = "photometric"
    FUSED = "fused"
    ARUCO = "aruco"


class Movement(StrEnum):
    """The paper's movements, Table 2."""

    SABAD = "SAbAd"
    SFE = "SFE"
    SIR = "SIR"
    COMB = "COMB"


class Sensor(StrEnum):
    """Simulated sensors."""

    PAPER = "paper"
    SR300 = "sr300"


class Side(StrEnum):
    """Arms."""

    RIGHT = "right"
    LEFT = "left"


class MarkerTexture(StrEnum):
    """What simulated marker plates carry."""

    DISKS = "disks"
    ARUCO = "aruco"


class SoftTissue(StrEnum):
    """How skin moves the markers of a simulated patient."""

    NONE = "none"
    PUBLISHED = "published"
    SEVERE = "severe"


Shifts = Annotated[
    list[str] | None,
    typer.Option(
        metavar="MARKER:AXIS:METRES[@START_S]",
        help="Displace a marker: m0 along the GH frame's axes, m1 along the elbow frame's (m1:z:0.02); again for more",
        show_default=False,
    ),
]
Turns = Annotated[
    list[str] | None,
    typer.Option(
        metavar="MARKER:AXIS:DEGREES[@START_S]",
        help="Turn a marker about its own centre and axes (m0:z:5); again for more",
        show_default=False,
    ),
]
Faults = Annotated[
    list[str] | None,
    typer.Option(
        metavar="KIND:...",
        help=(
            "Device fault: blind:r1:4:0.5, depth-lost:r0:4:2, drop:r1:0.1, late:r1:0.05:0.1 or encoders-silent:4:0.5; "
            "again for more (docs/disturbances.md)"
        ),
        show_default=False,
    ),
]
ImageFaults = Annotated[
    list[str] | None,
    typer.Option(
        "--image",
        metavar="KIND[:VALUE]",
        help=(
            "What is wrong with the images: bayer, defocus:0.8, motion-blur:0.008, distortion:-0.05, untold-distortion:0.01, "
            "wrong-color:12, gain:1.1 or gamma:1.2; again for more (docs/disturbances.md)"
        ),
        show_default=False,
    ),
]
