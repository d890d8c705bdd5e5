"""Attacks by real sessions on a station in a process of its own.

`python -m tests.security.attacks` prints the table of docs/security.md.
"""

import sys
import time
from collections.abc import Callable

import zenoh

from tests.security.floods import huge_message, idle_connections
from tests.security.impostors import forged_answer, forged_publisher, other_host, rogue_station, therapy_calibrates
from tests.security.intruders import (
    expired,
    expires_while_connected,
    foreign_authority,
    lookalike_authority,
    no_certificate,
    plain_tcp,
    revoked,
)
from tests.security.raw import open_raw
from tests.security.station import CALIBRATE_KEY
from tests.security.target import SETTLE_S, Outcome, Target, attacked, reads


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
        done = [reply.ok is not None for reply in session.get(CALIBRATE_KEY, timeout=SETTLE_S)]
    if done != [True]:
        problems.append("the operator cannot calibrate")
    return Outcome(
        "(control) who may, can", not problems, "; ".join(problems) or "therapy software reads, an operator calibrates"
    )


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
