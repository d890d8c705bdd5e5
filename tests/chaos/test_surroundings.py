"""The wall clock, the disk and the network around the service; and that nothing that publishes reads the wall clock."""

import ast
from pathlib import Path

import pytest

from tests.chaos.checking import check
from tests.chaos.faults import CHAOS
from tests.chaos.rig import chaos_rig
from tests.chaos.run import RIGS
from tests.chaos.wall_clock import compiler
from tests.hil.rig import ROOT


@pytest.mark.parametrize("kind", ["wall clock", "recording", "routed"])
def test_clock_disk_and_network(folder: Path, kind: str) -> None:
    if kind == "wall clock" and compiler() is None:
        pytest.skip("the library that turns the wall clock needs a C compiler")
    with chaos_rig(folder, **RIGS[kind]) as other:
        for chaos in CHAOS:
            if chaos.rig == kind and "by a day" not in chaos.name:
                check(other, chaos)
        if kind == "recording":
            kinds = [event.body["kind"] for event in other.subscriber.events]
            assert "recording_stopped" in kinds, "the full disk was not told"
        assert other.manager.ends == [], "the service was restarted"


# Where reading the wall clock is right, and what for.
WALL_CLOCK_USERS = {
    "drivers/ghest_drivers/hardware/realsense/camera.py": "the SDK's `global time` is on the wall clock of the same instant",
    "ghest_rt/cli/replay.py": "offset of t_sample_unix_ns",
    "ghest_rt/cli/run.py": "offset of t_sample_unix_ns",
}


def test_nothing_that_publishes_reads_the_wall_clock() -> None:
    found: dict[str, set[str]] = {}
    for top in (ROOT / "ghest_rt" / "service", ROOT / "ghest_rt" / "estimation", ROOT / "ghest_rt" / "sync", ROOT / "drivers"):
        for path in top.rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Attribute) and ast.unparse(node) in {
                    "time.time",
                    "time.time_ns",
                    "time.localtime",
                    "datetime.now",
                    "datetime.utcnow",
                    "datetime.datetime.now",
                }:
                    found.setdefault(str(path.relative_to(ROOT)), set()).add(ast.unparse(node))
    assert set(found) <= set(WALL_CLOCK_USERS), found
