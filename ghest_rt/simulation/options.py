"""What to simulate."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from ghest_rt.simulation.disturbances import MarkerMove, SoftTissueName
from ghest_rt.simulation.faults import DeviceFault
from ghest_rt.simulation.optics import Imaging
from ghest_rt.simulation.texture import MarkerTexture

HEIGHT_M = 1.75
"""The patient's height unless said otherwise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulateOptions:
    """What to simulate.

    Attributes:
        out: The recording to write.
        movement: A movement of Table 2 by name, or None with `motion`.
        motion: An OpenSim motion file, or None with `movement`.
        sensor: "paper" or "sr300".
        seed: The same seed gives the same bytes.
        duration_s: How much of the movement; None for all of it.
        arm: Which arm.
        height_m: The patient's height.
        marker: What is printed on the marker plates.
        brightness: Factor on the light in the room.
        white_balance: Factors on red, green and blue.
        station: A station file of your own; None for the shipped one of this sensor and arm.
        marker_moves: Markers that are not where the calibration says.
        soft_tissue: How skin moves the markers.
        faults: What the devices fail to deliver.
        color_only: Cameras without depth; the recording's station file says so.
        calibration_reference: The station file has what a calibration session saw besides the markers.
        imaging: What goes wrong with the colour images.
    """

    out: Path
    movement: str | None = None
    motion: Path | None = None
    sensor: Literal["paper", "sr300"] = "paper"
    seed: int = 0
    duration_s: float | None = None
    arm: Literal["right", "left"] = "right"
    height_m: float = HEIGHT_M
    marker: MarkerTexture = "disks"
    brightness: float = 1.0
    white_balance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    station: Path | None = None
    marker_moves: tuple[MarkerMove, ...] = ()
    soft_tissue: SoftTissueName = "none"
    faults: tuple[DeviceFault, ...] = ()
    color_only: bool = False
    calibration_reference: bool = False
    imaging: Imaging = field(default_factory=Imaging)
