"""Open a Zenoh session that talks to nobody unless told to: no scouting, only the endpoints given.

On this machine alone without further ado; beyond it only with an identity: mutual TLS, and access control by name.
"""

import json
import re
import socket
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import zenoh

from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.security.access import ASKED_KEYS, access_control, only_this_side_publishes
from ghest_rt.security.endpoints import split_endpoint, stays_here
from ghest_rt.security.handshake import try_handshake
from ghest_rt.security.identity import Identity
from ghest_rt.security.roles import SERVER_ROLES

Mode = Literal["peer", "client", "router"]

_SOURCE_PLACE = re.compile(r" at \S+?\.rs:\d+\.?")
_RETRY = {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 2}  # of lost connections; Zenoh's own: 1-4 s
_MAX_MESSAGE_BYTES = 1_000_000  # Zenoh's default lets a peer make us collect 1 GB
MAX_SESSIONS = 64
_MAX_PENDING = 16
_OPEN_TIMEOUT_MS = 5_000
_ASKED_MOST_HZ = 200.0  # each answer takes the interpreter's lock, which the loop needs, too


def open_session(
    listen: Sequence[str] = (), connect: Sequence[str] = (), identity: Identity | None = None, mode: Mode = "peer"
) -> tuple[zenoh.Session, tuple[str, ...]]:
    """Open a session and return it with the endpoints it really listens on (port 0 is resolved to a free one).

    Args:
        listen: Endpoints to listen on, like "tcp/127.0.0.1:7447".
        connect: Endpoints to connect to; peers that are not there yet are tried again by Zenoh.
        identity: Who we are; needed beyond this machine, with endpoints like "tls/bed-1.clinic.lan:7446".
        mode: What Zenoh calls the kind of node. A client has one connection, and is refused when nobody answers; a router
            passes messages on between clients and peers, but not from one peer to another.

    Raises:
        BadInputError: An endpoint is malformed or leaves this machine without an identity; the identity is none to listen with.
        GhestError: A port is taken, or Zenoh cannot open the session for another reason.
    """
    resolved = tuple(_with_port(endpoint) for endpoint in listen)
    settings = session_settings(resolved, connect, identity, mode)
    try:
        return _open(settings), resolved
    except zenoh.ZError as error:
        if identity is not None:
            for endpoint in connect:
                try_handshake(endpoint, identity)  # says more than Zenoh's time-out
        raise _told(error, resolved, connect) from error


def open_gateway(listen: Sequence[str], stations: Sequence[str], identity: Identity) -> tuple[zenoh.Session, tuple[str, ...]]:
    """Open a router's session between the network and stations of this machine; return it as `open_session` does.

    Args:
        listen: Endpoints for the network, with TLS.
        stations: Endpoints of stations on this machine, like "tcp/127.0.0.1:7447"; tried again until they are there.
        identity: A router's or a station's.

    Raises:
        BadInputError: An endpoint of the network is without TLS, or one of a station is not on this machine.
        GhestError: As `open_session`.
    """
    for endpoint in stations:
        if split_endpoint(endpoint)[0] != "tcp" or not stays_here(endpoint):
            raise BadInputError(f"{endpoint}: a gateway is connected to stations of its own machine: tcp/127.0.0.1:7447")
    resolved = tuple(_with_port(endpoint) for endpoint in listen)
    settings = session_settings(resolved, (), identity, "router")
    settings |= {"connect/endpoints": list(stations), "transport/link/protocols": ["tls", "tcp"]}
    if identity.access is not None:
        settings["access_control"] = access_control(identity.access, gateway=True)
    try:
        return _open(settings), resolved
    except zenoh.ZError as error:
        raise _told(error, resolved, stations) from error


def _open(settings: Mapping[str, Any]) -> zenoh.Session:
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def _told(error: zenoh.ZError, listen: Sequence[str], connect: Sequence[str]) -> GhestError:
    reason = _SOURCE_PLACE.sub("", str(error))
    if "in use" in reason:
        return GhestError(
            f"Zenoh cannot listen on {', '.join(listen)}: the port is taken, perhaps by another ghest-rt. "
            "Stop the other program, or choose another port with --listen (port 0 takes any free one)"
        )
    if "Unable to connect" in reason:
        return GhestError(f"nobody answers at {', '.join(connect)}")
    return GhestError(f"Zenoh cannot open a session (listen {list(listen)}, connect {list(connect)}): {reason}")


def session_settings(
    listen: Sequence[str], connect: Sequence[str], identity: Identity | None, mode: Mode = "peer"
) -> dict[str, Any]:
    """Return the settings of a session, by key of Zenoh's configuration.

    Raises:
        BadInputError: As `open_session`.
    """
    _check(listen, connect, identity)
    return {
        "mode": mode,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "connect/retry": _RETRY,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/rx/max_message_size": _MAX_MESSAGE_BYTES,
        "transport/unicast/max_sessions": MAX_SESSIONS,
        "transport/unicast/accept_pending": _MAX_PENDING,
        "transport/unicast/accept_timeout": _OPEN_TIMEOUT_MS,
        **({"access_control": only_this_side_publishes()} if listen and mode == "peer" else {}),
        **({} if identity is None else _secured(identity)),
    }


def _secured(identity: Identity) -> dict[str, Any]:
    certificate, key = str(identity.certificate), str(identity.key)
    tls = {
        "root_ca_certificate": str(identity.ca),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
    }
    settings: dict[str, Any] = {"transport/link/protocols": ["tls"], "transport/link/tls": tls}
    if identity.access is not None:
        settings["access_control"] = access_control(identity.access)
        rules = [{"key_expr": key, "freq": _ASKED_MOST_HZ} for key in ASKED_KEYS]
        settings["downsampling"] = [{"flows": ["ingress"], "messages": ["query"], "rules": rules}]
    return settings


def _check(listen: Sequence[str], connect: Sequence[str], identity: Identity | None) -> None:
    for endpoint in (*listen, *connect):
        protocol = split_endpoint(endpoint)[0]
        if identity is not None and protocol != "tls":
            raise BadInputError(
                f"{endpoint}: with an identity ({identity.role}.{identity.name}) every endpoint is tls/host:port; "
                "correct it, or leave the identity out"
            )
        if identity is None and protocol in ("tls", "quic"):
            raise BadInputError(f"{endpoint}: TLS needs an identity: ghest-rt certs issue makes one")
        if identity is None and not stays_here(endpoint):
            raise BadInputError(
                f"{endpoint} leaves this machine, and everybody on the way could read along: use tls/… with an identity "
                "(ghest-rt certs), or tcp/127.0.0.1:7447"
            )
    if listen and identity is not None and identity.role not in SERVER_ROLES:
        raise BadInputError(
            f"{identity.folder}: the identity of a {identity.role} connects, and cannot listen on {listen[0]}; "
            "issue one with --role router (gateway) or station"
        )


def _with_port(endpoint: str) -> str:
    protocol, host, port = split_endpoint(endpoint)
    if port or protocol not in ("tcp", "tls"):
        return endpoint
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
        probe.bind((host, 0))
        return f"{protocol}/{f'[{host}]' if ':' in host else host}:{probe.getsockname()[1]}"
