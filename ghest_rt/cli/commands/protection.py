"""The commands of networked stations and sealed recordings."""

from pathlib import Path
from typing import Annotated

import typer

from ghest_rt.cli.plain import PlainTyper

app = PlainTyper()


@app.command()
def gateway(
    identity: Annotated[
        Path, typer.Option(metavar="FOLDER", help="Of a router or a station, made by certs issue", show_default=False)
    ],
    listen: Annotated[
        list[str] | None,
        typer.Option(metavar="ENDPOINT", help="For the network; may be repeated; default tls/0.0.0.0:7446", show_default=False),
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

    run_gateway(identity, listen or (), station or ())


@app.command("recording-key")
def recording_key(
    out: Annotated[Path, typer.Option(metavar="FILE", help="Where the secret key goes", show_default=False)],
) -> None:
    """Make a pair of keys for sealed recordings (needs the extra 'security')."""
    from ghest_rt.cli.decrypt import recording_key as make_key

    make_key(out)


@app.command()
def decrypt(
    sealed: Annotated[
        list[Path],
        typer.Argument(metavar="RECORDING", help="Sealed recordings (.age), or folders of them", show_default=False),
    ],
    key: Annotated[Path, typer.Option(metavar="FILE", help="Secret key", show_default=False)],
    out: Annotated[Path | None, typer.Option(metavar="FOLDER", help="Where to, if not beside them", show_default=False)] = None,
) -> None:
    """Open sealed recordings (needs the extra 'security').

    A file that was cut off or changed is restored up to there, and the exit code is 2.
    """
    from ghest_rt.cli.decrypt import decrypt as open_sealed

    open_sealed(sealed, key, out)
