"""Open a Zenoh session that talks to nobody unless told to: no scouting, only the endpoints given."""

import json
import re
import socket
from collections.abc import Sequence

import zenoh

from ghest_rt.errors import BadInputError, GhestError

_ENDPOINT = re.compile(r"^(?P<protocol>tcp|tls|udp|ws|quic|unixsock-stream)/(?P<address>.+)$")
_SOURCE_PLACE = re.compile(r" at \S+?\.rs:\d+\.?")


def open_session(listen: Sequence[str] = (), connect: Sequence[str] = ()) -> tuple[zenoh.Session, tuple[str, ...]]:
    """Open a session and return it with the endpoints it really listens on (port 0 is resolved to a free one).

    Args:
        listen: Endpoints to listen on, like "tcp/127.0.0.1:7447".
        connect: Endpoints to connect to; peers that are not there yet are tried again by Zenoh.

    Raises:
        BadInputError: An endpoint is malformed.
        GhestError: A port is taken, or Zenoh cannot open the session for another reason.
    """
    for endpoint in (*listen, *connect):
        _check(endpoint)
    resolved = tuple(_with_port(endpoint) for endpoint in listen)
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps("peer"))
    config.insert_json5("listen/endpoints", json.dumps(resolved))
    config.insert_json5("connect/endpoints", json.dumps(list(connect)))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    try:
        return zenoh.open(config), resolved
    except zenoh.ZError as error:
        reason = _SOURCE_PLACE.sub("", str(error))
        if "in use" in reason:
            taken = ", ".join(resolved)
            raise GhestError(
                f"Zenoh cannot listen on {taken}: the port is taken, perhaps by another ghest-rt. "
                "Stop the other program, or choose another port: --listen tcp/127.0.0.1:7448 (port 0 takes any free one)"
            ) from error
        raise GhestError(f"Zenoh cannot open a session (listen {list(resolved)}, connect {list(connect)}): {reason}") from error


def _check(endpoint: str) -> None:
    match = _ENDPOINT.match(endpoint)
    address = match["address"].partition("#")[0] if match else ""
    port = address.rpartition(":")[2]
    if match is None or (match["protocol"] != "unixsock-stream" and not (port.isdigit() and int(port) < 65536)):
        raise BadInputError(f"{endpoint!r} is not a Zenoh endpoint: write protocol/host:port, for example tcp/127.0.0.1:7447")


def _with_port(endpoint: str) -> str:
    if not (endpoint.startswith("tcp/") and endpoint.endswith(":0")):
        return endpoint
    host = endpoint.removeprefix("tcp/").rpartition(":")[0]
    with socket.socket(socket.AF_INET6 if host.startswith("[") else socket.AF_INET) as probe:
        probe.bind((host.strip("[]"), 0))
        return f"tcp/{host}:{probe.getsockname()[1]}"
