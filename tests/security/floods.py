"""Those who send more than a station takes, or hold its connections."""

import socket
import time

from ghest_rt.security.endpoints import split_endpoint
from tests.security.raw import open_raw
from tests.security.station import CALIBRATE_KEY
from tests.security.target import FORGED, SETTLE_S, Outcome, Target, reads


def huge_message(target: Target) -> Outcome:
    """An operator's message of 20 MB: more than a station takes."""
    target.report()
    attack, key = "message of 20 MB by an operator", f"put {CALIBRATE_KEY}"
    with open_raw([target.endpoint], identity=target.clinic.operator, mode="client") as session:
        session.put(CALIBRATE_KEY, FORGED)
        time.sleep(0.3)
        small = target.report().get(key, 0)
        session.put(CALIBRATE_KEY, FORGED + bytes(20_000_000))
        time.sleep(SETTLE_S)
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
