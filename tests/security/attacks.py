"""Attacks by real sessions on a station in a process of its own.

`python -m tests.security.attacks` prints the table of docs/security.md.
"""

import json
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import zenoh

from ghest_rt.errors import GhestError
from ghest_rt.security.endpoints import split_endpoint
from ghest_rt.security.handshake import try_handshake
from ghest_rt.security.identity import CA_FILE, Identity
from ghest_rt.security.identity_check import load_identity
from ghest_rt.security.roles import parse_common_name
from ghest_rt.security.session import open_session
from tests.security.clinic import Clinic, let_expire, make_clinic
from tests.security.raw import open_raw
from tests.security.station import CALIBRATE_KEY

_ANGLES = "ghest/*/gh/angles"
_SETTLE_S = 0.8
_SHORT_LIFE_S = 4.0
_FORGED = b'{"forged": true}'


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
        replies = sum(reply.ok is not None for reply in session.get("ghest/sim/last", timeout=_SETTLE_S))
        tokens = sum(reply.ok is not None for reply in session.liveliness().get("ghest/*/alive", timeout=_SETTLE_S))
        time.sleep(0.1)
    parts = {"samples": got["samples"], "answers": replies, "tokens": tokens}
    return ", ".join(f"{count} {what}" for what, count in parts.items() if count)


def _cannot_read(attack: str, target: Target, session: zenoh.Session, how: str = "") -> Outcome:
    with session:
        got = reads(session, target)
    return Outcome(attack, not got, f"got {got}" if got else f"gets nothing{how}")


def _told(target: Target, identity: Path) -> str:
    """Return what our own handshake says of a refusal."""
    try:
        try_handshake(target.endpoint, _unchecked(identity))
    except GhestError as error:
        return f"; `certs check` says: {str(error).partition(': ')[2]}"
    return "; TLS lets it in, the access list does not"


def _unchecked(folder: Path) -> Identity:
    role, name = parse_common_name(folder.name)
    return Identity(folder, role, name, (), datetime.max.replace(tzinfo=UTC), None)


def no_certificate(target: Target) -> Outcome:
    """TLS with the right CA, but no certificate of one's own."""
    session = open_raw([target.endpoint], ca=target.clinic.station / CA_FILE)
    return _cannot_read("no certificate", target, session, ": the TLS handshake fails")


def plain_tcp(target: Target) -> Outcome:
    """No TLS at all."""
    _, host, port = split_endpoint(target.endpoint)
    return _cannot_read("plain TCP to the TLS port", target, open_raw([f"tcp/{host}:{port}"]), ": the TLS handshake fails")


def foreign_authority(target: Target) -> Outcome:
    """A certificate of another clinic."""
    identity = target.clinic.foreign
    session = open_raw([target.endpoint], identity=identity)
    return _cannot_read("certificate of another authority", target, session, _told(target, identity))


def lookalike_authority(target: Target) -> Outcome:
    """A certificate of an authority that bears the clinic's name."""
    identity = target.clinic.lookalike
    session = open_raw([target.endpoint], identity=identity)
    return _cannot_read("certificate of an authority with the clinic's name", target, session, _told(target, identity))


def expired(target: Target) -> Outcome:
    """A certificate since yesterday expired."""
    identity = target.clinic.expired
    session = open_raw([target.endpoint], identity=identity)
    return _cannot_read("expired certificate", target, session, _told(target, identity))


def revoked(target: Target) -> Outcome:
    """A revoked identity, its certificate still in force."""
    identity = target.clinic.revoked
    session = open_raw([target.endpoint], identity=identity)
    return _cannot_read("revoked identity", target, session, _told(target, identity))


def expires_while_connected(target: Target) -> Outcome:
    """A session that was opened in time and outlives its certificate."""
    let_expire(target.clinic, _SHORT_LIFE_S)
    gone = threading.Event()
    came = threading.Event()

    def watch(sample: zenoh.Sample) -> None:
        (came if sample.kind == zenoh.SampleKind.PUT else gone).set()

    with (
        open_raw([target.endpoint], identity=target.clinic.short_lived) as session,
        session.liveliness().declare_subscriber("ghest/*/alive", watch, history=True),
    ):
        connected = came.wait(3.0)
        closed = gone.wait(_SHORT_LIFE_S + 4.0)
        got = reads(session, target)
    held = connected and closed and not got
    seen = (
        "the station closes the link as soon as it has expired" if held else f"opened: {connected}, closed: {closed}, got {got}"
    )
    return Outcome("certificate expires during the session", held, seen)


def forged_publisher(target: Target) -> Outcome:
    """Therapy software that publishes angles as if it were the station."""
    target.report()
    with open_raw([target.endpoint], identity=target.clinic.therapy, mode="client") as session:
        for key in ("ghest/sim/gh/angles", "ghest/sim/health", "ghest/sim/events", "ghest/sim/gh"):
            for _ in range(10):
                session.put(key, _FORGED)
            session.delete(key)
        time.sleep(_SETTLE_S)
    arrived = target.report()
    return Outcome(
        "therapy software publishes angles",
        not arrived,
        f"arrived: {arrived}" if arrived else "dropped at the station; no subscriber sees them",
    )


def forged_answer(target: Target) -> Outcome:
    """Therapy software that answers others' queries in the station's place, and claims to be alive as a station."""

    def answer(query: zenoh.Query) -> None:
        query.reply(query.key_expr, _FORGED)

    with open_raw([target.endpoint], identity=target.clinic.therapy) as session:
        queryable = session.declare_queryable("ghest/*/last", answer, complete=True)
        token = session.liveliness().declare_token("ghest/forged/alive")
        time.sleep(0.3)
        answers = [reply.ok.payload.to_bytes() for reply in target.honest.get("ghest/*/last", timeout=_SETTLE_S) if reply.ok]
        tokens = [
            str(reply.ok.key_expr) for reply in target.honest.liveliness().get("ghest/*/alive", timeout=_SETTLE_S) if reply.ok
        ]
        token.undeclare()
        queryable.undeclare()
    held = len(answers) == 1 and _FORGED not in answers and tokens == ["ghest/sim/alive"]
    return Outcome(
        "therapy software answers queries, claims to be a station",
        held,
        "others get the station's answer and token alone" if held else f"{len(answers)} answers, {tokens}",
    )


def therapy_calibrates(target: Target) -> Outcome:
    """Therapy software that calibrates: by the key, by every wildcard that reaches it, and by publishing."""
    target.report()
    keys = (CALIBRATE_KEY, "ghest/*/calibrate/**", "ghest/sim/**", "ghest/**/run", "ghest/**", "**", "*/sim/*/run")
    answered = []
    with open_raw([target.endpoint], identity=target.clinic.therapy) as session:
        time.sleep(0.2)
        replies = [(key, session.get(key, timeout=_SETTLE_S)) for key in keys]
        answered = [key for key, found in replies for reply in found if reply.ok and b"done" in reply.ok.payload.to_bytes()]
    with open_raw([target.endpoint], identity=target.clinic.therapy, mode="client") as session:
        session.put(CALIBRATE_KEY, _FORGED)
        time.sleep(0.2)
    arrived = target.report()
    held = not arrived and not answered
    return Outcome(
        "therapy software calibrates, also by wildcards",
        held,
        "nothing reaches the calibration" if held else f"{arrived}, {answered}",
    )


def rogue_station(target: Target) -> Outcome:
    """Therapy software's certificate behind a port that subscribers take for a station."""
    endpoint = f"tls/127.0.0.1:{free_port()}"
    return _rogue(target, "therapy software's certificate poses as a station", endpoint, target.clinic.therapy)


def other_host(target: Target) -> Outcome:
    """Another station's certificate at this station's address."""
    endpoint = f"tls/127.0.0.1:{free_port()}"
    return _rogue(target, "another host's certificate at a station's address", endpoint, target.clinic.other_station)


def _rogue(target: Target, attack: str, endpoint: str, identity: Path) -> Outcome:
    seen = threading.Event()
    client = load_identity(target.clinic.operator)
    with open_raw(listen=[endpoint], identity=identity) as rogue:
        honest, _ = open_session((), (endpoint,), client)
        with honest, honest.declare_subscriber("ghest/**", lambda _: seen.set()):
            for _ in range(10):
                rogue.put("ghest/sim/gh/angles", _FORGED)
                time.sleep(_SETTLE_S / 10)
        try:
            try_handshake(endpoint, client)
            says = "no"
        except GhestError as error:
            says = str(error).partition(": ")[2]
    return Outcome(attack, not seen.is_set(), f"subscribers do not connect: {says}" if not seen.is_set() else "believed")


def huge_message(target: Target) -> Outcome:
    """An operator's message of 20 MB: more than a station takes."""
    target.report()
    attack, key = "message of 20 MB by an operator", f"put {CALIBRATE_KEY}"
    with open_raw([target.endpoint], identity=target.clinic.operator, mode="client") as session:
        session.put(CALIBRATE_KEY, _FORGED)
        time.sleep(0.3)
        small = target.report().get(key, 0)
        session.put(CALIBRATE_KEY, _FORGED + bytes(20_000_000))
        time.sleep(_SETTLE_S)
    huge = target.report().get(key, 0)
    return Outcome(
        attack, (small, huge) == (1, 0), "not collected: the limit is 1 MB; a small one arrives" if not huge else "arrived"
    )


def idle_connections(target: Target) -> Outcome:
    """A hundred connections that say nothing."""
    _, host, port = split_endpoint(target.endpoint)
    with open_raw([target.endpoint], identity=target.clinic.operator) as session:
        time.sleep(0.3)
        idle = [socket.create_connection((host, port)) for _ in range(100)]
        try:
            got = reads(session, target)
        finally:
            for one in idle:
                one.close()
    return Outcome("100 connections that say nothing", bool(got), f"who is connected still gets {got}" if got else "starved")


def honest_identities(target: Target) -> Outcome:
    """The control: those who may, can."""
    target.report()
    problems = []
    for folder in (target.clinic.therapy, target.clinic.operator):
        with open_raw([target.endpoint], identity=folder) as session:
            if len(reads(session, target).split(", ")) != 3:
                problems.append(f"{folder.name} cannot read")
    with open_raw([target.endpoint], identity=target.clinic.operator) as session:
        time.sleep(0.3)
        done = [reply.ok is not None for reply in session.get(CALIBRATE_KEY, timeout=_SETTLE_S)]
    if done != [True]:
        problems.append("the operator cannot calibrate")
    return Outcome(
        "(control) who may, can", not problems, "; ".join(problems) or "therapy software reads, an operator calibrates"
    )


def free_port() -> int:
    """Return a port that nobody listens on."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])


ATTACKS: tuple[Callable[[Target], Outcome], ...] = (
    expires_while_connected,
    honest_identities,
    plain_tcp,
    no_certificate,
    foreign_authority,
    lookalike_authority,
    expired,
    revoked,
    forged_publisher,
    forged_answer,
    therapy_calibrates,
    rogue_station,
    other_host,
    huge_message,
    idle_connections,
)


def table(outcomes: list[Outcome]) -> str:
    """Return the outcomes as a table in Markdown."""
    lines = ["| attack | held | how |", "|---|---|---|"]
    lines += [f"| {one.attack} | {'yes' if one.held else '**no**'} | {one.seen} |" for one in outcomes]
    return "\n".join(lines)


def main() -> None:
    """Run all attacks and print the table."""
    zenoh.try_init_log_from_env()
    with attacked() as target:
        sys.stdout.write(table([attack(target) for attack in ATTACKS]) + "\n")


if __name__ == "__main__":
    main()
