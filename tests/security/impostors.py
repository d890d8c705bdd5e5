"""Those who were let in, and do what their role may not: they pose as a station, or calibrate one."""

import threading
import time
from pathlib import Path

import zenoh

from ghest_rt.errors import GhestError
from ghest_rt.security.handshake import try_handshake
from ghest_rt.security.identity_check import load_identity
from ghest_rt.security.session import open_session
from tests.endpoints import free_port
from tests.security.raw import open_raw
from tests.security.station import CALIBRATE_KEY
from tests.security.target import FORGED, SETTLE_S, Outcome, Target


def forged_publisher(target: Target) -> Outcome:
    """Therapy software that publishes angles as if it were the station."""
    target.report()
    with open_raw([target.endpoint], identity=target.clinic.therapy, mode="client") as session:
        for key in ("ghest/sim/gh/angles", "ghest/sim/health", "ghest/sim/events", "ghest/sim/gh"):
            for _ in range(10):
                session.put(key, FORGED)
            session.delete(key)
        time.sleep(SETTLE_S)
    arrived = target.report()
    return Outcome(
        "therapy software publishes angles",
        not arrived,
        f"arrived: {arrived}" if arrived else "dropped at the station; no subscriber sees them",
    )


def forged_answer(target: Target) -> Outcome:
    """Therapy software that answers others' queries in the station's place, and claims to be alive as a station."""

    def answer(query: zenoh.Query) -> None:
        query.reply(query.key_expr, FORGED)

    with open_raw([target.endpoint], identity=target.clinic.therapy) as session:
        queryable = session.declare_queryable("ghest/*/last", answer, complete=True)
        token = session.liveliness().declare_token("ghest/forged/alive")
        time.sleep(0.3)
        answers = [reply.ok.payload.to_bytes() for reply in target.honest.get("ghest/*/last", timeout=SETTLE_S) if reply.ok]
        tokens = [
            str(reply.ok.key_expr) for reply in target.honest.liveliness().get("ghest/*/alive", timeout=SETTLE_S) if reply.ok
        ]
        token.undeclare()
        queryable.undeclare()
    held = len(answers) == 1 and FORGED not in answers and tokens == ["ghest/sim/alive"]
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
        replies = [(key, session.get(key, timeout=SETTLE_S)) for key in keys]
        answered = [key for key, found in replies for reply in found if reply.ok and b"done" in reply.ok.payload.to_bytes()]
    with open_raw([target.endpoint], identity=target.clinic.therapy, mode="client") as session:
        session.put(CALIBRATE_KEY, FORGED)
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
                rogue.put("ghest/sim/gh/angles", FORGED)
                time.sleep(SETTLE_S / 10)
        try:
            try_handshake(endpoint, client)
            says = "no"
        except GhestError as error:
            says = str(error).partition(": ")[2]
    return Outcome(attack, not seen.is_set(), f"subscribers do not connect: {says}" if not seen.is_set() else "believed")
