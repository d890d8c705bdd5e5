"""The service manager's side of sd_notify: a datagram socket that keeps what arrives, and when."""

import select
import socket
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self


@dataclass
class ManagerSocket:
    """Listens where systemd would."""

    path: Path
    received: list[tuple[float, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._socket.bind(str(self.path))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def wait_for(self, line: str, timeout_s: float) -> float | None:
        """Return when a notification with this line arrived; None if none does within the time."""
        deadline_s = time.monotonic() + timeout_s
        while True:
            text = self._take()
            if text is None:
                left_s = deadline_s - time.monotonic()
                if left_s <= 0 or not select.select([self._socket], [], [], left_s)[0]:
                    return None
            elif line in text.split("\n"):
                return self.received[-1][0]

    def drain(self) -> list[str]:
        """Take what has arrived."""
        return list(iter(self._take, None))

    def lines(self) -> list[str]:
        """Return every line received so far."""
        self.drain()
        return [line for _, text in self.received for line in text.split("\n")]

    def _take(self) -> str | None:
        try:
            text = self._socket.recv(65536).decode()
        except BlockingIOError:
            return None
        self.received.append((time.monotonic(), text))
        return text
