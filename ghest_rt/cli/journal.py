"""The log as structured entries of systemd's journal, where the service runs under systemd.

The native protocol (https://systemd.io/JOURNAL_NATIVE_PROTOCOL/): one datagram an entry, one field a line, the length spelt out
where a value has several lines. Entries carry `PRIORITY`, `LOGGER`, `CODE_FILE`, `CODE_LINE`, `CODE_FUNC`, and every attribute
of the log record that begins with `ghest_`: `journalctl -u ghest-rt GHEST_KIND=input_lost`.
"""

import logging
import os
import socket
import struct
import sys
from collections.abc import Mapping
from pathlib import Path

_SOCKET = Path("/run/systemd/journal/socket")
_IDENTIFIER = "ghest-rt"
_FIELD_PREFIX = "ghest_"


def priority_of(level: int) -> int:
    """Return syslog's priority of a log level: 7 debug, 6 info, 4 warning, 3 error, 2 critical."""
    for least, priority in ((logging.CRITICAL, 2), (logging.ERROR, 3), (logging.WARNING, 4), (logging.INFO, 6)):
        if level >= least:
            return priority
    return 7


def encode_entry(fields: Mapping[str, str]) -> bytes:
    """Return one entry as the journal's native protocol has it."""
    parts = []
    for name, value in fields.items():
        data = value.encode(errors="backslashreplace")
        if b"\n" in data:
            parts.append(name.encode() + b"\n" + struct.pack("<Q", len(data)) + data + b"\n")
        else:
            parts.append(name.encode() + b"=" + data + b"\n")
    return b"".join(parts)


class JournalHandler(logging.Handler):
    """Writes to the journal; never waits. What the journal does not take goes to standard error, with syslog's prefixes."""

    def __init__(self, address: Path = _SOCKET) -> None:
        super().__init__()
        self._address = str(address)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC | socket.SOCK_NONBLOCK)
        self.setFormatter(logging.Formatter("%(message)s"))

    def emit(self, record: logging.LogRecord) -> None:
        """Write one entry."""
        priority = priority_of(record.levelno)
        try:
            text = self.format(record)
            try:
                self._socket.sendto(encode_entry(self._fields(record, text, priority)), self._address)
            except OSError:
                sys.stderr.write("".join(f"<{priority}>{line}\n" for line in text.splitlines()))
        except (OSError, ValueError, TypeError):
            self.handleError(record)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
        super().close()

    @staticmethod
    def _fields(record: logging.LogRecord, text: str, priority: int) -> dict[str, str]:
        extra = {name.upper(): str(value) for name, value in vars(record).items() if name.startswith(_FIELD_PREFIX)}
        return {
            "MESSAGE": text,
            "PRIORITY": str(priority),
            "SYSLOG_IDENTIFIER": _IDENTIFIER,
            "LOGGER": record.name,
            "CODE_FILE": record.pathname,
            "CODE_LINE": str(record.lineno),
            "CODE_FUNC": record.funcName or "",
            **extra,
        }


def journal_handler(environment: Mapping[str, str], address: Path = _SOCKET) -> JournalHandler | None:
    """Return a handler if standard error is connected to the journal, as it is in a service; else None."""
    return JournalHandler(address) if stderr_is_journal(environment) else None


def stderr_is_journal(environment: Mapping[str, str]) -> bool:
    """Return whether `JOURNAL_STREAM` (systemd.exec(5)) names the file that standard error is."""
    stream = environment.get("JOURNAL_STREAM", "")
    if not stream:
        return False
    try:
        stat = os.fstat(2)
    except OSError:
        return False
    return stream == f"{stat.st_dev}:{stat.st_ino}"
