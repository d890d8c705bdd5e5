"""Zenoh endpoints: what one looks like, and which leave this machine."""

import ipaddress
import re

from ghest_rt.errors import BadInputError

_ENDPOINT = re.compile(r"^(?P<protocol>tcp|tls|udp|ws|quic|unixsock-stream)/(?P<address>.+)$")


def split_endpoint(endpoint: str) -> tuple[str, str, int]:
    """Return protocol, host and port of an endpoint; a Unix socket has its path as host and port 0.

    Raises:
        BadInputError: It is malformed.
    """
    match = _ENDPOINT.match(endpoint)
    address = match["address"].partition("#")[0].partition("?")[0] if match else ""
    if match is not None and match["protocol"] == "unixsock-stream":
        return match["protocol"], address, 0
    host, _, port = address.rpartition(":")
    if match is None or not host or not (port.isascii() and port.isdigit() and int(port) < 65536):
        raise BadInputError(f"{endpoint!r} is not a Zenoh endpoint: write protocol/host:port, for example tcp/127.0.0.1:7447")
    return match["protocol"], host.strip("[]"), int(port)


def stays_here(endpoint: str) -> bool:
    """Whether whatever passes this endpoint stays on this machine.

    Raises:
        BadInputError: It is malformed.
    """
    protocol, host, _ = split_endpoint(endpoint)
    if protocol == "unixsock-stream" or host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
