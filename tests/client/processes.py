"""Router, publisher and subscriber as processes of their own: `python -m tests.client.processes ROLE …`."""

import contextlib
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

from ghest_rt.client import Gap, GhestClient, Sample
from ghest_rt.security.session import open_session
from tests.client.fakes import FakeStation

QUIET_S = 20.0


def say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def tell(child: "subprocess.Popen[str]") -> None:
    """Let a process go on."""
    assert child.stdin is not None
    child.stdin.write("\n")
    child.stdin.flush()


def answer(child: "subprocess.Popen[str]") -> str:
    """Return the next line of a process."""
    assert child.stdout is not None
    return child.stdout.readline()


@contextlib.contextmanager
def process(*arguments: object) -> Iterator["subprocess.Popen[str]"]:
    """Start a role, wait until it says that it is ready, and end it at the end."""
    child = subprocess.Popen(
        [sys.executable, "-m", "tests.client.processes", *map(str, arguments)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert answer(child) == "ready\n"
        yield child
    finally:
        child.kill()
        child.communicate()


def route(endpoint: str) -> None:
    """A router, until standard input ends."""
    session, _ = open_session((endpoint,), mode="router")
    with session:
        say("ready")
        sys.stdin.read()


def publish(endpoint: str, way: str, count: int, period_s: float) -> None:
    """A station that publishes as soon as it reads a line, far faster than 66.6 Hz; prints what its calls to publish took."""
    with FakeStation(endpoint=endpoint, router=endpoint if way == "router" else None) as station:
        say("ready")
        sys.stdin.readline()
        took_ns = []
        for _ in range(count):
            before_ns = time.perf_counter_ns()
            station.publish()
            took_ns.append(time.perf_counter_ns() - before_ns)
            time.sleep(period_s)
        say(json.dumps(took_ns))
        sys.stdin.readline()  # what was published can still be asked for


def subscribe(endpoint: str, last_seq: int) -> None:
    """A client that takes everything up to a number; prints the numbers, those recovered, and the gaps."""
    with GhestClient(endpoint) as client, client.updates() as updates:
        say("ready")
        seqs, recovered, gaps = [], 0, 0
        while (update := updates.get(QUIET_S)) is not None:
            if isinstance(update, Sample):
                seqs.append(update.message.seq)
                recovered += update.recovered
            gaps += isinstance(update, Gap)
            if seqs and seqs[-1] >= last_seq:
                break
        say(json.dumps({"seqs": seqs, "recovered": recovered, "gaps": gaps}))


def hang(endpoint: str) -> None:
    """A bare subscriber whose program hangs as soon as something comes."""
    session, _ = open_session(connect=(endpoint,), mode="client")
    with session, session.declare_subscriber("ghest/*/gh/angles", lambda sample: threading.Event().wait()):
        say("ready")
        sys.stdin.read()


if __name__ == "__main__":
    role, address, *rest = sys.argv[1:]
    if role == "route":
        route(address)
    elif role == "publish":
        publish(address, rest[0], int(rest[1]), float(rest[2]))
    elif role == "subscribe":
        subscribe(address, int(rest[0]))
    else:
        hang(address)
