"""The whole service through what `python -m tests.chaos.run` measures, in short. Wide bounds: machines that test are busy."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.chaos.checking import check
from tests.chaos.faults import CHAOS, Chaos
from tests.chaos.manager import unit_seconds
from tests.chaos.rig import ChaosRig, chaos_rig

IN_SHORT = ("stopped, longer", "killed (SIGKILL)", "hangs", "burst")


@pytest.fixture(scope="module")
def rig(folder: Path) -> Iterator[ChaosRig]:
    with chaos_rig(folder) as rig:
        yield rig


def _short() -> list[Chaos]:
    return [chaos for chaos in CHAOS if any(words in chaos.name for words in IN_SHORT)]


@pytest.mark.parametrize("chaos", _short(), ids=lambda chaos: chaos.name)
def test_the_service_comes_back_and_nothing_stale_passes_for_fresh(rig: ChaosRig, chaos: Chaos) -> None:
    check(rig, chaos)
    if "hangs" in chaos.name:
        assert rig.manager.ends[-1][1] == "watchdog"


def test_the_units_times_leave_room_for_a_start_within_three_seconds() -> None:
    assert unit_seconds("WatchdogSec") + unit_seconds("TimeoutAbortSec") + unit_seconds("RestartSec") < 1.5
