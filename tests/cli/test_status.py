"""`ghest-rt status` beside running services, and without one."""

import json
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

from rich.console import Console

from ghest_rt.cli.station_watch import StationState
from ghest_rt.cli.status import page
from ghest_rt.messages.published import Health
from ghest_rt.security.session import open_session
from ghest_rt.service.health import HealthMeter, SampleCounts
from ghest_rt.service.pacing import Pacer
from tests.cli.conftest import Run
from tests.endpoints import free_endpoint
from tests.program import COMMAND


@contextmanager
def service(recording: Path, endpoint: str) -> Iterator["subprocess.Popen[bytes]"]:
    running = subprocess.Popen(
        [*COMMAND, "--replay", recording, "--loop", "--listen", endpoint], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield running
    finally:
        running.send_signal(signal.SIGTERM)
        running.wait(timeout=20)


def test_a_running_station_is_shown_and_told_as_json(ghest_rt: Run, blank: Path) -> None:
    endpoint = free_endpoint()
    with service(blank, endpoint):
        told = ghest_rt("status", "--connect", endpoint, "--json", "--wait", "50")
        shown = ghest_rt("status", "--connect", endpoint, "--wait", "50")
    assert told.returncode == 0, told.stderr
    ((name, station),) = json.loads(told.stdout)["stations"].items()
    assert station["alive"]
    Health.model_validate(station["health"])
    assert shown.returncode == 0, shown.stderr
    for word in (name, "Hz", "p99.9", "r0", "encoders", "CPU"):
        assert word in shown.stdout


def test_several_stations_are_told_apart_and_one_that_only_lives_is_shown(ghest_rt: Run) -> None:
    endpoint = free_endpoint()
    session, _ = open_session(listen=(endpoint,))
    with session:
        tokens = [session.liveliness().declare_token(f"ghest/bed-{k}/alive") for k in (1, 2)]
        all_of_them = ghest_rt("status", "--connect", endpoint, "--json", "--wait", "4")
        one = ghest_rt("status", "--connect", endpoint, "--json", "--wait", "4", "--station", "bed-2")
        del tokens
    assert set(json.loads(all_of_them.stdout)["stations"]) == {"bed-1", "bed-2"}
    assert set(json.loads(one.stdout)["stations"]) == {"bed-2"}
    assert json.loads(one.stdout)["stations"]["bed-2"] == {"alive": True, "silent_s": None, "health": None, "events": []}


def test_without_a_station_the_exit_code_is_3(ghest_rt: Run) -> None:
    endpoint = free_endpoint()
    session, _ = open_session(listen=(endpoint,))
    with session:
        nobody = ghest_rt("status", "--connect", endpoint, "--json", "--wait", "0.3")
    assert nobody.returncode == 3
    assert json.loads(nobody.stdout) == {"stations": {}}
    assert "no station is alive" in nobody.stderr


def test_what_cannot_be_a_station_is_refused(ghest_rt: Run) -> None:
    refused = ghest_rt("status", "--station", "bed/1")
    assert refused.returncode == 2
    assert "not a station id" in refused.stderr


def test_a_station_that_tells_nothing_any_more_is_called_silent_or_gone() -> None:
    pacer = Pacer(lambda: 0, lambda t_ns: t_ns, lambda k, t_ns: None)
    health = HealthMeter(0, SampleCounts(), pacer, {}).measure(0, 1, 1)
    states = {"hung": StationState(True, health, 100.0), "dead": StationState(False, health, 100.0)}
    out = StringIO()
    Console(file=out, width=120).print(page(states, 110.0))
    lines = out.getvalue().splitlines()
    assert any("hung" in line and "silent for 10 s" in line for line in lines)
    assert any("dead" in line and "gone" in line for line in lines)
