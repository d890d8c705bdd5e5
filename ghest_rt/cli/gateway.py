"""`ghest-rt gateway`: the stations of this machine on the network, in a process of its own."""

import signal
import threading
from collections.abc import Sequence
from pathlib import Path

import typer

from ghest_rt.security.gateway import Gateway
from ghest_rt.security.identity import use_identity

DEFAULT_LISTEN = "tls/0.0.0.0:7446"  # not the stations' 7447: every address includes loopback, where that is taken
DEFAULT_STATION = "tcp/127.0.0.1:7447"


def run_gateway(identity: Path, listen: Sequence[str], stations: Sequence[str]) -> None:
    """Run until a signal asks to stop.

    Args:
        identity: Folder of a router's or a station's.
        listen: Endpoints for the network; none for the default.
        stations: Endpoints of stations on this machine; none for the default.

    Raises:
        BadInputError: The identity or an endpoint cannot be used.
        GhestError: A port is taken, or the extra `security` is not installed.
    """
    listen, stations = listen or [DEFAULT_LISTEN], stations or [DEFAULT_STATION]
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: stop.set())
    gateway = Gateway(listen, stations, use_identity(identity))
    typer.echo(f"{', '.join(gateway.endpoints)} for {', '.join(stations)}")
    try:
        gateway.run(stop)
    finally:
        gateway.close()
