"""The station that is attacked, in a process of its own, and what came of it."""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import zenoh

from ghest_rt.security.identity_check import load_identity
from ghest_rt.security.session import open_session
from tests.security.clinic import Clinic, make_clinic

_ANGLES = "ghest/*/gh/angles"
SETTLE_S = 0.8
FORGED = b'{"forged": true}'


@dataclass(frozen=True)
class Outcome:
    """What became of an attack.

    Attributes:
        attack: What was tried.
        held: Whether the defence held.
        seen: What was observed.
    """

    attack: str
    held: bool
    seen: str


class Target:
    """The attacked station, and an honest subscriber beside."""

    def __init__(self, clinic: Clinic) -> None:
        self.clinic = clinic
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.security.station", str(clinic.station)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.endpoint = self._line()
        self.honest, _ = open_session((), (self.endpoint,), load_identity(clinic.therapy))
        self._forged_seen = 0
        self._subscriber = self.honest.declare_subscriber("ghest/**", self._watch)

    def _watch(self, sample: zenoh.Sample) -> None:
        self._forged_seen += b"forged" in sample.payload.to_bytes()

    def _line(self) -> str:
        if self._process.stdout is None:
            raise RuntimeError("the station has no output")
        return self._process.stdout.readline().strip()

    def report(self) -> dict[str, int]:
        """Return what came in at the station and reached its programs, and forgeries at the subscriber, since the last call."""
        if self._process.stdin is None:
            raise RuntimeError("the station has no input")
        self._process.stdin.write("report\n")
        self._process.stdin.flush()
        came_in: dict[str, int] = json.loads(self._line())
        seen, self._forged_seen = self._forged_seen, 0
        return came_in | ({"forged at the subscriber": seen} if seen else {})

    def close(self) -> None:
        """End all."""
        self._subscriber.undeclare()
        self.honest.close()
        self._process.communicate(timeout=20)


@contextmanager
def attacked() -> Iterator[Target]:
    """A clinic with its station running."""
    with tempfile.TemporaryDirectory() as folder:
        target = Target(make_clinic(Path(folder)))
        try:
            yield target
        finally:
            target.close()


def reads(session: zenoh.Session, target: Target) -> str:
    """Subscribe and ask, and say what was got; "" for nothing."""
    got = {"samples": 0}

    def count(_: zenoh.Sample) -> None:
        got["samples"] += 1

    with session.declare_subscriber(_ANGLES, count):
        replies = sum(reply.ok is not None for reply in session.get("ghest/sim/last", timeout=SETTLE_S))
        tokens = sum(reply.ok is not None for reply in session.liveliness().get("ghest/*/alive", timeout=SETTLE_S))
        time.sleep(0.1)
    parts = {"samples": got["samples"], "answers": replies, "tokens": tokens}
    return ", ".join(f"{count} {what}" for what, count in parts.items() if count)
