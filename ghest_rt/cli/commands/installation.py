"""The commands that look after a workstation."""

from pathlib import Path
from typing import Annotated

import typer

from ghest_rt.cli.options import Json
from ghest_rt.cli.plain import PlainTyper

app = PlainTyper()


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
    as_json: Json = False,
) -> None:
    """Say what is there, what is missing and what to do: installation, permissions, cameras, encoders, station file."""
    from ghest_rt.cli.doctor.command import run_doctor

    code = run_doctor(station, live_s, as_json)
    if code:
        raise typer.Exit(code)


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
    gateway: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Also let other machines in by a gateway with this identity (certs issue --role router)",
            show_default=False,
        ),
    ] = None,
    root_dir: Annotated[
        Path, typer.Option("--root", metavar="FOLDER", help="Install into an image of a system; nothing is started")
    ] = Path("/"),
) -> None:
    """Make a station a service of systemd that starts with the machine, or undo it (as root)."""
    from ghest_rt.cli.install_service.command import InstallOptions
    from ghest_rt.cli.install_service.command import install_service as install

    install(InstallOptions(station, name, cpus, executable, gateway, root_dir, uninstall, dry_run))
