"""Between the network and the stations of this machine: a Zenoh router in a process of its own.

Everything that strangers can reach is in this process, with its own limits of memory, processor and files; the service itself
listens on this machine alone. Zenoh's TLS listener takes connections faster than it gives up on those whose handshake fails
(ten a second, https://github.com/eclipse-zenoh/zenoh/issues/2685), so a flood of them uses up a process's file descriptors:
here they are watched, and the session is opened anew before none is left, and when a flood is over, so that nobody waits for
what it has left behind.
"""

import logging
import threading
from collections.abc import Sequence
from pathlib import Path

from ghest_rt.security.identity import Identity
from ghest_rt.security.session import MAX_SESSIONS, open_gateway

_log = logging.getLogger(__name__)

_FILES = Path("/proc/self/fd")
_LOOK_S = 0.5
_NORMAL = MAX_SESSIONS + 32  # files that connections may need, beyond those open at the start


class Gateway:
    """Passes messages between stations of this machine and whoever the identity's access list allows.

    Args:
        listen: Endpoints for the network, with TLS.
        stations: Endpoints of stations on this machine.
        identity: A router's or a station's.
        most_files: Open files at which the session is opened anew.

    Attributes:
        endpoints: What it really listens on.
        reopened: How often the session was opened anew.
    """

    def __init__(self, listen: Sequence[str], stations: Sequence[str], identity: Identity, most_files: int = 2000) -> None:
        self._stations = tuple(stations)
        self._identity = identity
        self._most_files = most_files
        self._session, self.endpoints = open_gateway(listen, self._stations, identity)
        self._base = _open_files()
        self.reopened = 0

    def run(self, stop: threading.Event) -> None:
        """Watch until told to stop.

        Raises:
            GhestError: The session could not be opened anew.
        """
        before = 0
        while not stop.wait(_LOOK_S):
            files = _open_files()
            over = files <= before and files > self._base + _NORMAL
            before = files
            if over or files > self._most_files:
                _log.warning("%d files are open: unfinished handshakes of a flood; all connections are dropped", files)
                self._session.close()  # type: ignore[no-untyped-call]
                self._session, _ = open_gateway(self.endpoints, self._stations, self._identity)
                self.reopened += 1

    def close(self) -> None:
        """Close the session."""
        self._session.close()  # type: ignore[no-untyped-call]


def _open_files() -> int:
    return sum(1 for _ in _FILES.iterdir())
