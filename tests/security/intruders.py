"""Those who may not come in, or no longer: they try to read what a station publishes."""

import threading
from datetime import UTC, datetime
from pathlib import Path

import zenoh

from ghest_rt.errors import GhestError
from ghest_rt.security.endpoints import split_endpoint
from ghest_rt.security.handshake import try_handshake
from ghest_rt.security.identity import CA_FILE, Identity
from ghest_rt.security.roles import parse_common_name
from tests.security.clinic import let_expire
from tests.security.raw import open_raw
from tests.security.target import Outcome, Target, reads

_SHORT_LIFE_S = 4.0


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
    return _refused(target, "certificate of another authority", target.clinic.foreign)


def lookalike_authority(target: Target) -> Outcome:
    """A certificate of an authority that bears the clinic's name."""
    return _refused(target, "certificate of an authority with the clinic's name", target.clinic.lookalike)


def expired(target: Target) -> Outcome:
    """A certificate since yesterday expired."""
    return _refused(target, "expired certificate", target.clinic.expired)


def revoked(target: Target) -> Outcome:
    """A revoked identity, its certificate still in force."""
    return _refused(target, "revoked identity", target.clinic.revoked)


def _refused(target: Target, attack: str, identity: Path) -> Outcome:
    session = open_raw([target.endpoint], identity=identity)
    return _cannot_read(attack, target, session, _told(target, identity))


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
