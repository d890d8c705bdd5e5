"""The real service process and a real notification socket."""

import os
import queue
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from ghest_rt.security.session import open_session
from tests.cli.recordings import write_blank_recording
from tests.endpoints import free_endpoint
from tests.program import COMMAND
from tests.systemd.manager_socket import ManagerSocket

WATCHDOG_S = 0.8
START_S = 30.0


@pytest.fixture(scope="module")
def blank(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_blank_recording(tmp_path_factory.mktemp("recordings") / "blank.mcap", frames=40)


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[ManagerSocket]:
    with ManagerSocket(tmp_path / "notify") as manager:
        yield manager


class Running:
    """The service, started as systemd starts it."""

    def __init__(self, manager: ManagerSocket, *arguments: object, watchdog_s: float = WATCHDOG_S) -> None:
        environment = {**os.environ, "NOTIFY_SOCKET": str(manager.path), "WATCHDOG_USEC": str(round(watchdog_s * 1e6))}
        self.process = subprocess.Popen(
            [*COMMAND, *map(str, arguments)], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def __enter__(self) -> "subprocess.Popen[str]":
        return self.process

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.kill()
        self.process.communicate(timeout=20)


def test_ready_comes_with_the_first_sample_published(manager: ManagerSocket, blank: Path) -> None:
    endpoint = free_endpoint()
    heard: queue.SimpleQueue[int] = queue.SimpleQueue()
    session, _ = open_session(connect=(endpoint,))
    with (
        session,
        session.declare_subscriber("ghest/*/gh/angles", lambda sample: heard.put(1)),
        Running(manager, "--replay", blank, "--loop", "--listen", endpoint) as service,
    ):
        assert manager.wait_for("READY=1", START_S) is not None, "never ready"
        assert manager.received[0][1].startswith("READY=1\nSTATUS=lost"), "something came before READY, or READY without state"
        heard.get(timeout=10)  # and samples do leave
        service.send_signal(signal.SIGTERM)
        assert service.wait(timeout=20) == 0
    assert manager.lines().count("READY=1") == 1  # though the recording was repeated


def test_a_station_that_cannot_be_used_is_never_ready(manager: ManagerSocket, tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    station.write_text("format = 1\n")
    with Running(manager, "run", "--station", station) as service:
        assert service.wait(timeout=20) == 2
    assert "READY=1" not in manager.lines()


def test_the_watchdog_is_fed_while_the_loop_ticks_and_only_then(manager: ManagerSocket, blank: Path) -> None:
    with Running(manager, "--replay", blank, "--loop", "--no-publish") as service:
        assert manager.wait_for("READY=1", START_S) is not None
        for _ in range(6):
            assert manager.wait_for("WATCHDOG=1", WATCHDOG_S) is not None, "systemd would have ended a healthy service"
        service.send_signal(signal.SIGSTOP)
        manager.wait_for("nothing", 0.2)
        assert manager.wait_for("WATCHDOG=1", 2 * WATCHDOG_S) is None, "a stopped service is fed"
        service.send_signal(signal.SIGCONT)
        assert manager.wait_for("WATCHDOG=1", WATCHDOG_S) is not None
        service.send_signal(signal.SIGTERM)
        assert manager.wait_for("STOPPING=1", 10) is not None
        assert service.wait(timeout=20) == 0


def test_a_loop_that_hangs_is_not_fed_though_other_threads_run(manager: ManagerSocket, tmp_path: Path, blank: Path) -> None:
    # The event loop sleeps within a tick; all other threads, and the process, are well.
    wrapper = tmp_path / "hang.py"
    wrapper.write_text(
        "import time\n"
        "from ghest_rt.cli.live import LiveView\n"
        "from ghest_rt.cli.main import main\n"
        "LiveView.angles = lambda self, message, estimate: time.sleep(30 * (message.seq == 60))\n"
        "main()\n"
    )
    environment = {**os.environ, "NOTIFY_SOCKET": str(manager.path), "WATCHDOG_USEC": str(round(WATCHDOG_S * 1e6))}
    service = subprocess.Popen(
        [sys.executable, wrapper, "--replay", blank, "--loop", "--no-publish"],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        assert manager.wait_for("READY=1", START_S) is not None
        while manager.wait_for("WATCHDOG=1", 2 * WATCHDOG_S) is not None:
            assert len(manager.received) < 40, "never hung"
        assert service.poll() is None
    finally:
        service.kill()
        service.wait(timeout=20)


def test_stopping_is_told_once_and_last(manager: ManagerSocket, blank: Path) -> None:
    with Running(manager, "--replay", blank, "--loop", "--no-publish") as service:
        assert manager.wait_for("READY=1", START_S) is not None
        service.send_signal(signal.SIGTERM)
        assert service.wait(timeout=20) == 0
    lines = manager.lines()
    assert lines.count("STOPPING=1") == 1
    assert manager.received[-1][1] == "STOPPING=1\nSTATUS=stopping"


def test_the_state_is_shown(manager: ManagerSocket, blank: Path) -> None:
    with Running(manager, "--replay", blank, "--loop", "--no-publish") as service:
        assert manager.wait_for("READY=1", START_S) is not None
        assert manager.wait_for("WATCHDOG=1", 5) is not None
        while manager.wait_for("WATCHDOG=1", 5) is not None and not (
            states := [line for line in manager.lines() if line.startswith("STATUS=") and "Hz" in line]
        ):
            assert len(manager.received) < 40
        service.send_signal(signal.SIGTERM)
        assert service.wait(timeout=20) == 0
    assert all("r0 " in line and "r1 " in line and "encoders " in line for line in states)
