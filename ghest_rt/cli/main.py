"""Entry point of `ghest-rt`. Commands import what they need when they run, so that `--help` is quick."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from ghest_rt.cli.certs import app as certs_app
from ghest_rt.cli.options import Faults, ImageFaults, MarkerTexture, Method, Movement, Sensor, Shifts, Side, SoftTissue, Turns
from ghest_rt.cli.study.app import app as study_app
from ghest_rt.errors import GhestError

app = typer.Typer(
    name="ghest-rt",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    help=(
        "Glenohumeral (shoulder) angles inside a rehabilitation exoskeleton, in real time, from two RGB-D cameras "
        "and the encoders.\n\n"
        "Try it without hardware: [bold]ghest-rt --replay sim_fixtures/[/] and, in a second terminal, [bold]ghest-rt listen[/]"
    ),
)

app.add_typer(study_app)
app.add_typer(certs_app, name="certs")

_MOVEMENTS = "|".join(Movement)
_Recording = Annotated[Path, typer.Argument(metavar="RECORDING", help="Recording (.mcap)", show_default=False)]
_MethodOption = Annotated[
    Method | None,
    typer.Option(help="How markers are found and angles estimated; by default what the station file says", show_default=False),
]
_Json = Annotated[
    bool, typer.Option("--json", metavar="", help="Print one JSON document on standard output and nothing else there")
]
_Listen = Annotated[
    str | None,
    typer.Option(
        metavar="ENDPOINT",
        help="Where Zenoh listens, instead of the station file's endpoints; tcp/127.0.0.1:0 takes any free port",
        show_default=False,
    ),
]
_NoPublish = Annotated[bool, typer.Option("--no-publish", metavar="", help="Do not open Zenoh at all")]
_Verbose = Annotated[bool, typer.Option("--verbose", "-v", metavar="", help="Log more, to standard error")]


@app.callback(invoke_without_command=True)
def root(
    context: typer.Context,
    replay: Annotated[
        Path | None,
        typer.Option(
            "--replay",
            metavar="PATH",
            help="Run the service from a recording, or from every recording of a folder, one after the other",
            show_default=False,
        ),
    ] = None,
    speed: Annotated[
        str,
        typer.Option(
            metavar="FACTOR|max",
            help="Pace of the replay: 1 as recorded, 2.5 faster; 'max' publishes every sample as fast as the machine allows",
        ),
    ] = "1",
    loop: Annotated[bool, typer.Option("--loop", metavar="", help="Replay again and again until stopped")] = False,
    method: _MethodOption = None,
    station: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Station file to use instead of the one in the recording", show_default=False),
    ] = None,
    listen: _Listen = None,
    no_publish: _NoPublish = False,
    as_json: _Json = False,
    verbose: _Verbose = False,
    version: Annotated[bool, typer.Option("--version", metavar="", help="Print the version")] = False,
) -> None:
    """Run from a recording with --replay, or use one of the commands."""
    from ghest_rt.cli.console import set_up_logging

    set_up_logging(verbose)
    if version:
        from ghest_rt import __version__

        typer.echo(__version__)
    elif context.invoked_subcommand is not None:
        if replay is not None:
            raise typer.BadParameter(f"--replay and the command {context.invoked_subcommand!r} exclude each other")
    elif replay is None:
        raise typer.BadParameter("name a recording with --replay, or a command (see ghest-rt --help)")
    else:
        from ghest_rt.cli.replay import ReplayOptions, replay_path

        replay_path(ReplayOptions(replay, speed, loop, method, station, listen, not no_publish, as_json))


@app.command()
def run(
    station: Annotated[Path, typer.Option(metavar="FILE", help="Station file", show_default=False)],
    method: _MethodOption = None,
    listen: _Listen = None,
    no_publish: _NoPublish = False,
    duration_s: Annotated[
        float | None, typer.Option("--duration", min=0.1, metavar="SECONDS", help="Stop after this long", show_default=False)
    ] = None,
    movement: Annotated[
        Movement,
        typer.Option(help="What the patient of a simulated station does (Table 2)", case_sensitive=False, metavar=_MOVEMENTS),
    ] = Movement.COMB,
    seed: Annotated[int, typer.Option(metavar="N", help="Of a simulated station")] = 0,
    as_json: _Json = False,
) -> None:
    """Run the service on a station's devices, real or simulated (backend 'sim', needs the extra 'sim')."""
    from ghest_rt.cli.run import RunOptions, run_station

    run_station(RunOptions(station, method, listen, not no_publish, duration_s, as_json, movement, seed))


@app.command()
def record(
    station: Annotated[Path, typer.Option(metavar="FILE", help="Station file", show_default=False)],
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where the recordings go", show_default=False)],
    part_mb: Annotated[int, typer.Option("--part-mb", min=1, metavar="MB", help="Begin another file at this size")] = 4000,
    part_min: Annotated[
        float, typer.Option("--part-min", min=0.01, metavar="MINUTES", help="Begin another file after this time")
    ] = 10.0,
    compress: Annotated[
        bool, typer.Option("--compress", metavar="", help="Smaller files for more processor time (zstd, without loss)")
    ] = False,
    method: _MethodOption = None,
    listen: _Listen = None,
    no_publish: _NoPublish = False,
    duration_s: Annotated[
        float | None, typer.Option("--duration", min=0.1, metavar="SECONDS", help="Stop after this long", show_default=False)
    ] = None,
    encrypt_to: Annotated[
        list[str] | None,
        typer.Option(
            "--encrypt-to", metavar="AGE1…", help="Seal the files for this public key; may be repeated", show_default=False
        ),
    ] = None,
    subject: Annotated[
        str | None,
        typer.Option(metavar="PSEUDONYM", help="Of the patient, like P-0042, written into the files", show_default=False),
    ] = None,
    movement: Annotated[
        Movement,
        typer.Option(help="What the patient of a simulated station does (Table 2)", case_sensitive=False, metavar=_MOVEMENTS),
    ] = Movement.COMB,
    seed: Annotated[int, typer.Option(metavar="N", help="Of a simulated station")] = 0,
    as_json: _Json = False,
) -> None:
    """Run the service as `run` does and record everything its devices deliver, without loss."""
    from ghest_rt.cli.recording import RecordOptions
    from ghest_rt.cli.run import RunOptions, run_station

    recording = RecordOptions(out, part_mb * 1_000_000, round(part_min * 60e9), compress, tuple(encrypt_to or ()), subject)
    run_station(RunOptions(station, method, listen, not no_publish, duration_s, as_json, movement, seed, recording))


@app.command()
def simulate(
    out: Annotated[Path, typer.Option(metavar="FILE", help="Recording to write (.mcap)", show_default=False)],
    movement: Annotated[
        Movement | None,
        typer.Option(
            help="One of the paper's movements (Table 2)", show_default=False, case_sensitive=False, metavar=_MOVEMENTS
        ),
    ] = None,
    motion: Annotated[
        Path | None, typer.Option(metavar="FILE", help="OpenSim motion file (.mot) of a shoulder instead", show_default=False)
    ] = None,
    sensor: Annotated[
        Sensor, typer.Option(help="paper: the paper's ideal sensor; sr300: 640x480 with the real one's faults")
    ] = (Sensor.PAPER),
    seed: Annotated[int, typer.Option(metavar="N", help="The same seed gives the same bytes")] = 0,
    duration_s: Annotated[
        float | None, typer.Option("--duration", metavar="SECONDS", help="Only the first seconds", show_default=False)
    ] = None,
    arm: Annotated[Side, typer.Option(help="The patient's arm in the exoskeleton")] = Side.RIGHT,
    height_m: Annotated[float, typer.Option("--height", metavar="METRES", help="The patient's height")] = 1.75,
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
    as_json: _Json = False,
) -> None:
    """Record a simulated patient in the exoskeleton, with the true angles (needs the extra 'sim')."""
    from ghest_rt.cli.extras import need_simulation

    need_simulation()
    from ghest_rt.cli.simulate import simulate_recording
    from ghest_rt.simulation.command import SimulateOptions
    from ghest_rt.simulation.disturbances import parse_shift, parse_turn
    from ghest_rt.simulation.faults import parse_fault
    from ghest_rt.simulation.optics import parse_imaging

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
        ),
        as_json,
    )


@app.command()
def estimate(
    recording: _Recording,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Table to write: .csv or .parquet", show_default=False)],
    method: _MethodOption = None,
    station: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Station file to use instead of the one in the recording", show_default=False),
    ] = None,
    as_json: _Json = False,
) -> None:
    """Turn a recording into a table of angles, off line, as fast as the machine allows."""
    from ghest_rt.cli.estimate import estimate as estimate_recording

    estimate_recording(recording, method, out, station, as_json)


@app.command()
def score(
    recordings: Annotated[
        list[Path], typer.Argument(metavar="RECORDING...", help="Recordings with truth, or folders of them", show_default=False)
    ],
    method: _MethodOption = None,
    as_json: _Json = False,
) -> None:
    """Compare estimates with the truth in simulated recordings: the paper's error metrics."""
    from ghest_rt.cli.score import score_paths

    score_paths(recordings, method, as_json)


@app.command()
def picture(
    recording: _Recording,
    out: Annotated[Path, typer.Option(metavar="FILE", help="Picture to write: .png, .svg or .pdf", show_default=False)],
    method: _MethodOption = None,
) -> None:
    """Draw what the cameras see, the angles beside the truth, and the error (needs the extra 'plots')."""
    from ghest_rt.cli.picture import draw

    draw(recording, out, method)


@app.command()
def listen(
    connect: Annotated[str, typer.Option(metavar="ENDPOINT", help="Where a ghest-rt publishes")] = "tcp/127.0.0.1:7447",
    station: Annotated[str, typer.Option(metavar="ID", help="Only this station")] = "*",
    identity: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Who you are, for endpoints with TLS", show_default=False)
    ] = None,
    count: Annotated[
        int | None, typer.Option(min=1, metavar="N", help="Stop after so many samples", show_default=False)
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", metavar="", help="Print the messages as they come, one JSON document a line")
    ] = False,
) -> None:
    """Print the angles that a running ghest-rt publishes."""
    from ghest_rt.cli.listen import listen_to

    listen_to(connect, station, identity, count, as_json)


@app.command()
def status(
    connect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Where a ghest-rt, or a router, listens (tcp/127.0.0.1:7447); repeatable",
            show_default=False,
        ),
    ] = None,
    station: Annotated[
        str, typer.Option("--station", metavar="NAME", help="Only the station with this id; * for all that are found")
    ] = "*",
    wait_s: Annotated[
        float, typer.Option("--wait", min=0.1, metavar="SECONDS", help="How long to wait for what they say")
    ] = 3.0,
    watch: Annotated[bool, typer.Option("--watch", "-w", metavar="", help="Go on until stopped")] = False,
    identity: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Who you are, for endpoints with TLS", show_default=False)
    ] = None,
    as_json: _Json = False,
) -> None:
    """Say how the running stations are; exit code 3 if there is none."""
    from ghest_rt.cli.status import show_status

    endpoints = tuple(connect or ["tcp/127.0.0.1:7447"])
    show_status(endpoints, station, identity=identity, wait_s=wait_s, watch=watch, as_json=as_json)


@app.command()
def schema(
    out: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Write one file per message instead of printing", show_default=False)
    ] = None,
) -> None:
    """Print the JSON Schemas of the published messages."""
    from ghest_rt.cli.schema import show_schemas

    show_schemas(out)


@app.command()
def doctor(
    station: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Station file whose devices shall be there", show_default=False)
    ] = None,
    live_s: Annotated[
        float | None,
        typer.Option(
            "--live", metavar="SECONDS", min=0.5, help="Also open the station's devices and measure them", show_default=False
        ),
    ] = None,
    as_json: _Json = False,
) -> None:
    """Say what is there, what is missing and what to do: installation, permissions, cameras, encoders, station file."""
    from ghest_rt.cli.doctor.command import run_doctor

    code = run_doctor(station, live_s, as_json)
    if code:
        raise typer.Exit(code)


@app.command()
def decrypt(
    sealed: Annotated[
        list[Path],
        typer.Argument(metavar="RECORDING...", help="Sealed recordings (.age), or folders of them", show_default=False),
    ],
    key: Annotated[Path, typer.Option(metavar="FILE", help="Secret key", show_default=False)],
    out: Annotated[Path | None, typer.Option(metavar="FOLDER", help="Where to, if not beside them", show_default=False)] = None,
) -> None:
    """Open sealed recordings (needs the extra 'security')."""
    from ghest_rt.cli.decrypt import decrypt as open_sealed

    open_sealed(sealed, key, out)


@app.command()
def gateway(
    identity: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Of a router or a station, made by certs issue", show_default=False)
    ],
    listen: Annotated[
        list[str] | None,
        typer.Option(metavar="ENDPOINT", help="For the network; may be repeated; default tls/0.0.0.0:7447", show_default=False),
    ] = None,
    station: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="A station of this machine; may be repeated; default tcp/127.0.0.1:7447",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Let therapy software on other machines reach the stations of this one (needs the extra 'security')."""
    from ghest_rt.cli.gateway import run_gateway

    run_gateway(identity, listen or ["tls/0.0.0.0:7447"], station or ["tcp/127.0.0.1:7447"])


@app.command("recording-key")
def recording_key(
    out: Annotated[Path, typer.Option(metavar="FILE", help="Where the secret key goes", show_default=False)],
) -> None:
    """Make a pair of keys for sealed recordings (needs the extra 'security')."""
    from ghest_rt.cli.decrypt import recording_key as make_key

    make_key(out)


@app.command("install-service")
def install_service(
    station: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Station file to install; without, the installed one is kept", show_default=False),
    ] = None,
    name: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of this station, if the machine has several", show_default=False)
    ] = None,
    uninstall: Annotated[bool, typer.Option("--uninstall", metavar="", help="Undo the installation")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", metavar="", help="Only show what would be done")] = False,
    cpus: Annotated[
        str | None, typer.Option(metavar="LIST", help="Run the service on these CPUs only, for example 2-3", show_default=False)
    ] = None,
    executable: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The ghest-rt that the unit starts, if not this one", show_default=False)
    ] = None,
    root_dir: Annotated[
        Path, typer.Option("--root", metavar="FOLDER", help="Install into an image of a system; nothing is started")
    ] = Path("/"),
) -> None:
    """Make a station a service of systemd that starts with the machine, or undo it (as root)."""
    from ghest_rt.cli.install_service.command import InstallOptions
    from ghest_rt.cli.install_service.command import install_service as install

    install(InstallOptions(station, name, cpus, executable, root_dir, uninstall, dry_run))


def main() -> None:
    """Run the command line; errors that a user can mend become one message and an exit code."""
    try:
        app()
    except GhestError as error:
        _fail(str(error), error.exit_code)
    except KeyboardInterrupt:
        _fail("interrupted", 130)
    except Exception as error:
        from ghest_drivers.errors import DriverError

        if not isinstance(error, DriverError):
            raise
        _fail(str(error), 3)


def _fail(message: str, exit_code: int) -> None:
    sys.stderr.write(f"ghest-rt: {message}\n")
    sys.exit(exit_code)


if __name__ == "__main__":
    main()
