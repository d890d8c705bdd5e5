"""Network addresses for a test of its own."""

import socket


def free_port() -> int:
    """Return a port that nobody listens on."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])


def free_endpoint() -> str:
    """Return a Zenoh endpoint on such a port."""
    return f"tcp/127.0.0.1:{free_port()}"
