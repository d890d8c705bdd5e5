"""Floods one station's port for the benchmark `flood` and prints how many messages it sent; or is the decoy that is flooded.

`python -m benchmarks.flooder KIND ENDPOINT IDENTITY SECONDS`
"""

import contextlib
import socket
import sys
import time
from collections.abc import Callable
from pathlib import Path

import zenoh

from ghest_rt.security.endpoints import split_endpoint
from ghest_rt.security.identity_check import load_identity
from ghest_rt.security.session import open_session

_FORGED = bytes(1000)


def queries(session: zenoh.Session) -> None:
    """Ask for the last sample, without waiting for the answer."""
    session.get("ghest/*/last", lambda _: None)


def forgeries(session: zenoh.Session) -> None:
    """Publish angles."""
    session.put("ghest/sim/gh/angles", _FORGED)


def declarations(session: zenoh.Session) -> None:
    """Subscribe, and withdraw it at once."""
    session.declare_subscriber("ghest/*/gh/angles", lambda _: None).undeclare()


_BY_SESSION: dict[str, Callable[[zenoh.Session], None]] = {
    "queries": queries,
    "forgeries": forgeries,
    "declarations": declarations,
}
KINDS = (*_BY_SESSION, "handshakes")


def _be_flooded(endpoint: str, seconds: float) -> None:
    def answer(query: zenoh.Query) -> None:
        query.reply("ghest/sim/last", _FORGED)

    session, _ = open_session((endpoint,))
    with session, session.declare_queryable("ghest/sim/last", answer):
        time.sleep(seconds)


def main() -> None:
    """Flood until the time is over."""
    kind, endpoint, folder, seconds = sys.argv[1:]
    end_s = time.monotonic() + float(seconds)
    sent = 0
    if kind == "decoy":
        _be_flooded(endpoint, float(seconds))
        return
    if kind == "handshakes":
        _, host, port = split_endpoint(endpoint)
        while time.monotonic() < end_s:
            with contextlib.suppress(ConnectionError), socket.create_connection((host, port)) as link:
                link.sendall(_FORGED)
            sent += 1
    else:
        # A peer sends only what the other side wants; a client sends everything.
        session, _ = open_session((), (endpoint,), load_identity(Path(folder)), "client")
        with session:
            while time.monotonic() < end_s:
                _BY_SESSION[kind](session)
                sent += 1
    print(sent)


if __name__ == "__main__":
    main()
