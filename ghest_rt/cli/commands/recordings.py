"""The commands that make and use recordings."""

from pathlib import Path
from typing import Annotated

import typer

from ghest_rt.calibration.arm_axis import ArmAxis
from ghest_rt.cli.options import (
    MOVEMENTS,
    Faults,
    ImageFaults,
    Json,
    MarkerTexture,
    MethodOption,
    Movement,
    OtherStation,
    RecordingFile,
    Sensor,
    Shifts,
    Side,
    SoftTissue,
    Turns,
)
from ghest_rt.cli.plain import PlainTyper

app = PlainTyper()


@app.command()
def simulate(
    out: Annotated[Path, typer.Option(metavar="FILE", help="Recording to write (.mcap)", show_default=False)],
    movement: Annotated[
        Movement | None,
        typer.Option(
            help="One of the paper's movements (Table 2), or CAL: a calibration session",
            show_default=False,
            case_sensitive=False,
            metavar=f"{MOVEMENTS}|CAL",
        ),
    ] = None,
    motion: Annotated[
        Path | None, typer.Option(metavar="FILE", help="OpenSim motion file (.mot) of a shoulder instead", show_default=False)
    ] = None,
    sensor: Annotated[
        Sensor, typer.Option(help="paper: the paper's ideal sensor; sr300: 640x480 with the real one's faults")
    ] = (Sensor.PAPER),
    seed: Annotated[int, typer.Option(metavar="N", help="The same seed gives the same bytes; from 0")] = 0,
    duration_s: Annotated[
        float | None,
        typer.Option("--duration", metavar="SECONDS", help="Only the first seconds; more than 0", show_default=False),
    ] = None,
    arm: Annotated[Side, typer.Option(help="The patient's arm in the exoskeleton")] = Side.RIGHT,
    height_m: Annotated[float, typer.Option("--height", metavar="METRES", help="The patient's height, 1.4 to 2.1")] = 1.75,
    marker: Annotated[MarkerTexture, typer.Option(help="What is printed on the marker plates")] = MarkerTexture.DISKS,
    station: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Station file of your own instead of the shipped one", show_default=False),
    ] = None,
    marker_shift: Shifts = None,
    marker_turn: Turns = None,
    soft_tissue: Annotated[
        SoftTissue, typer.Option(help="Skin that moves the markers on the bones (docs/disturbances.md)")
    ] = SoftTissue.NONE,
    fault: Faults = None,
    image: ImageFaults = None,
    color_only: Annotated[bool, typer.Option("--color-only", metavar="", help="Cameras without depth")] = False,
    calibration_reference: Annotated[
        bool,
        typer.Option("--calibration-reference", metavar="", help="Station file with \\[calibration.reference]"),
    ] = False,
    as_json: Json = False,
) -> None:
    """Record a simulated patient in the exoskeleton, with the true angles (needs the extra 'sim').

    Say what the patient does by --movement or --motion; only the simulated knee has one movement of its own.

    Example: [bold]ghest-rt simulate --movement COMB --sensor sr300 --seed 1 --duration 4 --out rec.mcap[/]
    """
    from ghest_rt.extras import need_extra

    need_extra("sim", "a simulated patient")
    from ghest_rt.cli.simulate import simulate_recording
    from ghest_rt.simulation.disturbances import parse_shift, parse_turn
    from ghest_rt.simulation.faults import parse_fault
    from ghest_rt.simulation.optics import parse_imaging
    from ghest_rt.simulation.options import SimulateOptions

    shifts, turns = map(parse_shift, marker_shift or ()), map(parse_turn, marker_turn or ())
    simulate_recording(
        SimulateOptions(
            out=out,
            movement=None if movement is None else movement.value,
            motion=motion,
            sensor=sensor.value,
            seed=seed,
            duration_s=duration_s,
            arm=arm.value,
            height_m=height_m,
            marker=marker.value,
            station=station,
            marker_moves=(*shifts, *turns),
            soft_tissue=soft_tissue.value,
            faults=tuple(map(parse_fault, fault or ())),
            imaging=parse_imaging(image or ()),
            color_only=color_only,
            calibration_reference=calibration_reference,
        ),
        as_json,
    )


@app.command()
def estimate(
    recording: RecordingFile,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Table to write: .csv or .parquet", show_default=False)],
    method: MethodOption = None,
    station: OtherStation = None,
    as_json: Json = False,
) -> None:
    """Turn a recording into a table of angles, off line, as fast as the machine allows.

    Its columns: docs/recording-format.md, "The table of ghest-rt estimate".
    """
    from ghest_rt.cli.estimate import estimate as estimate_recording

    estimate_recording(recording, method, out, station, as_json)


@app.command()
def score(
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING", help="Recordings with truth, or folders of them", show_default=False)
    ],
    method: MethodOption = None,
    as_json: Json = False,
) -> None:
    """Compare estimates with the truth in simulated recordings: the paper's error metrics.

    Example: [bold]ghest-rt score sim_fixtures --method refined[/]
    """
    from ghest_rt.cli.score import score_paths

    score_paths(recordings, method, as_json)


@app.command()
def picture(
    recording: RecordingFile,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Picture to write: .png, .svg or .pdf", show_default=False)],
    method: MethodOption = None,
) -> None:
    """Draw what the cameras see, the angles beside the truth, and the error (needs the extra 'plots')."""
    from ghest_rt.cli.picture import draw

    draw(recording, out, method)


@app.command()
def calibrate(
    recording: RecordingFile,
    station: Annotated[Path, typer.Option(metavar="FILE", help="Station file to calibrate", show_default=False)],
    out: Annotated[
        Path, typer.Option(metavar="FILE", help="New station file to write, beside the old one", show_default=False)
    ],
    calibration_id: Annotated[
        str | None, typer.Option("--id", metavar="NAME", help="Of the new calibration; the recording's name otherwise")
    ] = None,
    elbow: Annotated[
        ArmAxis, typer.Option(help="What gives the arm's axis: the neutral posture, or the exoskeleton's elbow")
    ] = (ArmAxis.POSTURE),
    arm_length_m: Annotated[
        float | None,
        typer.Option("--arm-length", metavar="METRES", min=0.15, max=0.5, help="From elbow to GH centre as measured"),
    ] = None,
    posture_unchecked: Annotated[
        bool,
        typer.Option(
            "--posture-unchecked", metavar="", help="Take a neutral posture that the exoskeleton's elbow cannot vouch for"
        ),
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Picture of the residuals to write: .png, .svg or .pdf")
    ] = None,
    force: Annotated[bool, typer.Option("--force", metavar="", help="Overwrite the output file")] = False,
    as_json: Json = False,
) -> None:
    """Calibrate a station by a recorded session: neutral posture, then the shoulder moved about (docs/calibration.md)."""
    from ghest_rt.cli.calibrate import calibrate_recording

    calibrate_recording(
        recording,
        station,
        out,
        calibration_id=calibration_id,
        elbow_from=elbow,
        arm_length_m=arm_length_m,
        posture_unchecked=posture_unchecked,
        picture=picture,
        force=force,
        as_json=as_json,
    )
