"""Tell systemd how the service does: the sd_notify(3) protocol, driven by what the loop publishes.

`READY=1` goes out with the first published sample, `WATCHDOG=1` with samples thereafter (never from a timer: a loop that no
longer ticks is not alive), `STATUS=` once a second, `STOPPING=1` at the end. Outside systemd nothing is sent.
"""

import os
import socket
import time
from collections.abc import Callable, MutableMapping
from types import TracebackType
from typing import Self

from ghest_rt.messages.published import Event, GhAngles, Health
from ghest_rt.messages.results import GhEstimate, Reason

_FEEDS_PER_TIMEOUT = 4
_NEVER_NS = 1 << 62


class NotifySocket:
    """The service manager's datagram socket; sending never waits and never raises."""

    def __init__(self, address: str) -> None:
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC | socket.SOCK_NONBLOCK)

    def send(self, *lines: str) -> bool:
        """Send assignments; return whether the kernel took them."""
        try:
            self._socket.sendto("\n".join(lines).encode(), self._address)
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class ServiceManager:
    """An output of the service that keeps systemd informed; put it last, so that only a tick that everybody got counts.

    Enter it around everything that publishes; leaving it says that the service stops.
    """

    def __init__(self, notify: NotifySocket | None, watchdog_ns: int | None, now_ns: Callable[[], int]) -> None:
        """Prepare.

        Args:
            notify: Where to; None outside systemd.
            watchdog_ns: systemd's patience; None if it does not watch.
            now_ns: The monotonic clock that systemd goes by, not a scaled one.
        """
        self._notify = notify
        self._now_ns = now_ns
        self._feed_every_ns = _NEVER_NS if watchdog_ns is None else watchdog_ns // _FEEDS_PER_TIMEOUT
        self._fed_ns = 0
        self._ready = False

    @classmethod
    def from_environment(cls, environment: MutableMapping[str, str], pid: int, now_ns: Callable[[], int]) -> Self:
        """Take systemd's variables out of the environment, so that child processes do not speak for the service.

        Args:
            environment: `os.environ`.
            pid: Of this process; a watchdog meant for another is not fed.
            now_ns: CLOCK_MONOTONIC.
        """
        address = environment.pop("NOTIFY_SOCKET", "")
        patience_us = environment.pop("WATCHDOG_USEC", "")
        watched_pid = environment.pop("WATCHDOG_PID", str(pid))
        notify = NotifySocket(address) if address.startswith(("/", "@")) else None
        watched = patience_us.isdigit() and int(patience_us) > 0 and watched_pid == str(pid)
        return cls(notify, int(patience_us) * 1000 if watched else None, now_ns)

    @property
    def present(self) -> bool:
        """Whether systemd, or something that speaks its protocol, started the service."""
        return self._notify is not None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._notify is not None:
            self._notify.send("STOPPING=1", "STATUS=stopping" if error is None else f"STATUS={_one_line(error)}")
            self._notify.close()

    def angles(self, message: GhAngles, estimate: GhEstimate) -> None:
        """A sample is out: the service is ready, and alive."""
        if self._notify is None:
            return
        if not self._ready:
            self._ready = self._notify.send("READY=1", f"STATUS={_state(message)}")
            return
        now_ns = self._now_ns()
        if now_ns - self._fed_ns >= self._feed_every_ns and self._notify.send("WATCHDOG=1"):
            self._fed_ns = now_ns

    def health(self, message: Health) -> None:
        """Show the state in `systemctl status`."""
        if self._notify is not None:
            inputs = ", ".join(f"{name} {item.state}" for name, item in message.inputs.items())
            self._notify.send(f"STATUS={_state(message)}; {message.rate_hz:.1f} Hz; {inputs}")

    def event(self, message: Event) -> None:
        """Events are in the journal already."""


def service_manager() -> ServiceManager:
    """Return the one that started this process."""
    return ServiceManager.from_environment(os.environ, os.getpid(), time.monotonic_ns)


def _state(message: GhAngles | Health) -> str:
    return str(message.status) if message.reason is Reason.NONE else f"{message.status} ({message.reason})"


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
