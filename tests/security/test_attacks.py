"""Every attack of docs/security.md on a station in a process of its own, by real sessions."""

from collections.abc import Callable

import pytest

from tests.security.attacks import ATTACKS
from tests.security.target import Outcome, Target


@pytest.mark.slow
@pytest.mark.parametrize("attack", ATTACKS, ids=lambda attack: attack.__name__)
def test_the_defence_holds(target: Target, attack: Callable[[Target], Outcome]) -> None:
    outcome = attack(target)
    assert outcome.held, f"{outcome.attack}: {outcome.seen}"
