"""The commands around a running service."""

from pathlib import Path
from typing import Annotated

import typer

from ghest_rt.cli.options import (
    Duration,
    Identity,
    Json,
    ListenEndpoint,
    MethodOption,
    Movement,
    NoPublish,
    SimulatedMovement,
    SimulatedSeed,
    StationFile,
)
from ghest_rt.cli.plain import PlainTyper

app = PlainTyper()


@app.command()
def run(
    station: StationFile,
    method: MethodOption = None,
    listen: ListenEndpoint = None,
    no_publish: NoPublish = False,
    duration_s: Duration = None,
    movement: SimulatedMovement = Movement.COMB,
    seed: SimulatedSeed = 0,
    as_json: Json = False,
) -> None:
    """Run the service on a station's devices, real or simulated (backend 'sim', needs the extra 'sim')."""
    from ghest_rt.cli.run import RunOptions, run_station

    run_station(RunOptions(station, method, listen, not no_publish, duration_s, as_json, movement, seed))


@app.command()
def record(
    station: StationFile,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where the recordings go", show_default=False)],
    part_mb: Annotated[int, typer.Option("--part-mb", min=1, metavar="MB", help="Begin another file at this size")] = 4000,
    part_min: Annotated[
        float, typer.Option("--part-min", min=0.01, metavar="MINUTES", help="Begin another file after this time")
    ] = 10.0,
    compress: Annotated[
        bool, typer.Option("--compress", metavar="", help="Smaller files for more processor time (zstd, without loss)")
    ] = False,
    method: MethodOption = None,
    listen: ListenEndpoint = None,
    no_publish: NoPublish = False,
    duration_s: Duration = None,
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
    movement: SimulatedMovement = Movement.COMB,
    seed: SimulatedSeed = 0,
    as_json: Json = False,
) -> None:
    """Run the service as `run` does and record everything its devices deliver, without loss."""
    from ghest_rt.cli.recording import RecordOptions
    from ghest_rt.cli.run import RunOptions, run_station

    recording = RecordOptions(out, part_mb * 1_000_000, round(part_min * 60e9), compress, tuple(encrypt_to or ()), subject)
    run_station(RunOptions(station, method, listen, not no_publish, duration_s, as_json, movement, seed, recording))


@app.command()
def listen(
    connect: Annotated[str, typer.Option(metavar="ENDPOINT", help="Where a ghest-rt publishes")] = "tcp/127.0.0.1:7447",
    station: Annotated[str, typer.Option(metavar="ID", help="Only this station")] = "*",
    identity: Identity = None,
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
    identity: Identity = None,
    as_json: Json = False,
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
