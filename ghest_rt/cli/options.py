"""Choices and options that several commands offer."""

from enum import StrEnum
from pathlib import Path
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
    """The paper's movements, Table 2, and that of a calibration session (docs/calibration.md)."""

    SABAD = "SAbAd"
    SFE = "SFE"
    SIR = "SIR"
    COMB = "COMB"
    CAL = "CAL"


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


MOVEMENTS = "|".join(movement for movement in Movement if movement is not Movement.CAL)

RecordingFile = Annotated[Path, typer.Argument(metavar="RECORDING", help="Recording (.mcap)", show_default=False)]
StationFile = Annotated[Path, typer.Option(metavar="FILE", help="Station file", show_default=False)]
OtherStation = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Station file to use instead of the one in the recording", show_default=False),
]
MethodOption = Annotated[
    Method | None,
    typer.Option(help="How markers are found and angles estimated; by default what the station file says", show_default=False),
]
ListenEndpoint = Annotated[
    str | None,
    typer.Option(
        metavar="ENDPOINT",
        help="Where Zenoh listens, instead of the station file's endpoints; tcp/127.0.0.1:0 takes any free port",
        show_default=False,
    ),
]
NoPublish = Annotated[bool, typer.Option("--no-publish", metavar="", help="Do not open Zenoh at all")]
Identity = Annotated[
    Path | None, typer.Option(metavar="FOLDER", help="Who you are, for endpoints with TLS", show_default=False)
]
Duration = Annotated[
    float | None,
    typer.Option(
        "--duration",
        min=0.1,
        metavar="SECONDS",
        help="Stop after this long; exit code 3 if a device delivered nothing all along (without it, devices are waited for)",
        show_default=False,
    ),
]
SimulatedMovement = Annotated[
    Movement,
    typer.Option(help="What the patient of a simulated station does (Table 2)", case_sensitive=False, metavar=MOVEMENTS),
]
SimulatedSeed = Annotated[int, typer.Option(metavar="N", help="Of a simulated station")]
Json = Annotated[
    bool, typer.Option("--json", metavar="", help="Print one JSON document on standard output and nothing else there")
]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", metavar="", help="Log more, to standard error; before or after a command")
]
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
