"""What is told to systemd, message by message, and what the journal gets."""

import logging
import os
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from ghest_rt.cli.journal import JournalHandler, encode_entry, stderr_is_journal
from ghest_rt.messages.published import GhAngles
from ghest_rt.messages.results import GhEstimate, Reason, Status
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.notify import ServiceManager
from tests.systemd.manager_socket import ManagerSocket

SECOND_NS = 1_000_000_000


class Clock:
    def __init__(self) -> None:
        self.t_ns = 100 * SECOND_NS

    def now_ns(self) -> int:
        return self.t_ns


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[ManagerSocket]:
    with ManagerSocket(tmp_path / "notify") as manager:
        yield manager


def sample() -> tuple[GhAngles, GhEstimate]:
    estimate = GhEstimate(0, Status.LOST, Reason.STARTING, None, None, None, None, None, {})
    return AnglesComposer("right", "refined", "nominal", 0, Numbering()).compose(estimate, 0), estimate


def environment(manager: ManagerSocket, **more: str) -> dict[str, str]:
    return {"NOTIFY_SOCKET": str(manager.path), "WATCHDOG_USEC": "2000000", "HOME": "/", **more}


def test_the_watchdog_is_fed_four_times_within_its_patience(manager: ManagerSocket, clock: Clock) -> None:
    with ServiceManager.from_environment(environment(manager), 1, clock.now_ns) as service:
        assert manager.lines() == []
        for _ in range(400):  # four seconds
            service.angles(*sample())
            clock.t_ns += SECOND_NS // 100
            manager.drain()
    lines = manager.lines()
    assert lines[:2] == ["READY=1", "STATUS=lost (starting)"]
    assert lines.count("WATCHDOG=1") == 8
    assert lines[-2:] == ["STOPPING=1", "STATUS=stopping"]


def test_an_error_is_told_at_the_end(manager: ManagerSocket, clock: Clock) -> None:
    with pytest.raises(OSError, match="gone"), ServiceManager.from_environment(environment(manager), 1, clock.now_ns):
        raise OSError("the camera\nis gone")
    assert manager.lines() == ["STOPPING=1", "STATUS=the camera is gone"]


@pytest.mark.parametrize("more", [{"WATCHDOG_PID": "2"}, {"WATCHDOG_USEC": "0"}, {"WATCHDOG_USEC": "soon"}])
def test_a_watchdog_that_is_not_ours_is_not_fed(manager: ManagerSocket, clock: Clock, more: dict[str, str]) -> None:
    with ServiceManager.from_environment(environment(manager, **more), 1, clock.now_ns) as service:
        for _ in range(5):
            service.angles(*sample())
            clock.t_ns += 10 * SECOND_NS
    lines = manager.lines()
    assert "READY=1" in lines
    assert "WATCHDOG=1" not in lines


def test_child_processes_do_not_inherit_the_socket(manager: ManagerSocket, clock: Clock) -> None:
    variables = environment(manager, WATCHDOG_PID="1")
    with ServiceManager.from_environment(variables, 1, clock.now_ns):
        assert variables == {"HOME": "/"}


def test_without_systemd_nothing_happens(clock: Clock) -> None:
    with ServiceManager.from_environment({}, 1, clock.now_ns) as service:
        assert not service.present
        service.angles(*sample())


def test_a_manager_that_does_not_read_holds_up_nothing_and_hears_ready_later(manager: ManagerSocket, clock: Clock) -> None:
    with ServiceManager.from_environment(environment(manager), 1, clock.now_ns) as service:
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as filler, pytest.raises(BlockingIOError):
            while True:
                filler.sendto(b"X=1", str(manager.path))
        ticker = threading.Thread(target=lambda: [service.angles(*sample()) for _ in range(5)], daemon=True)
        ticker.start()
        ticker.join(20)
        assert not ticker.is_alive(), "a tick waits for systemd"
        assert "READY=1" not in manager.lines()
        service.angles(*sample())
        assert manager.lines().count("READY=1") == 1


def test_an_abstract_socket(clock: Clock) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        name = f"ghest-rt-test-{os.getpid()}"
        listener.bind(f"\0{name}")
        listener.settimeout(5)
        with ServiceManager.from_environment({"NOTIFY_SOCKET": f"@{name}"}, 1, clock.now_ns) as service:
            service.angles(*sample())
            assert listener.recv(1000).startswith(b"READY=1")


def parse_entry(data: bytes) -> dict[str, str]:
    """Read an entry as the journal does."""
    fields = {}
    while data:
        line, _, data = data.partition(b"\n")
        name, equals, value = line.partition(b"=")
        if not equals:
            (size,) = struct.unpack("<Q", data[:8])
            value, data = data[8 : 8 + size], data[8 + size + 1 :]
        fields[name.decode()] = value.decode()
    return fields


def record(message: str, **extra: str) -> logging.LogRecord:
    return logging.getLogger("ghest_rt.test").makeRecord(
        "ghest_rt.test", logging.WARNING, "loop.py", 7, message, (), None, "tick", extra
    )


def test_an_entry_of_the_journal_has_its_fields(tmp_path: Path) -> None:
    with ManagerSocket(tmp_path / "journal") as journal:
        handler = JournalHandler(journal.path)
        handler.emit(record("r0: input lost: no frames", ghest_source="r0", ghest_kind="input_lost"))
        handler.close()
        (entry,) = (parse_entry(text.encode()) for text in journal.drain())
    assert entry == {
        "MESSAGE": "r0: input lost: no frames",
        "PRIORITY": "4",
        "SYSLOG_IDENTIFIER": "ghest-rt",
        "LOGGER": "ghest_rt.test",
        "CODE_FILE": "loop.py",
        "CODE_LINE": "7",
        "CODE_FUNC": "tick",
        "GHEST_SOURCE": "r0",
        "GHEST_KIND": "input_lost",
    }


def test_a_message_cannot_forge_fields() -> None:
    assert parse_entry(encode_entry({"MESSAGE": "a\nPRIORITY=0\nb", "PRIORITY": "6"})) == {
        "MESSAGE": "a\nPRIORITY=0\nb",
        "PRIORITY": "6",
    }


def test_without_the_journal_lines_carry_their_priority(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    handler = JournalHandler(tmp_path / "nothing")
    handler.emit(record("first\nsecond"))
    handler.close()
    assert capsys.readouterr().err == "<4>first\n<4>second\n"


def test_the_journal_is_used_only_if_standard_error_goes_there(tmp_path: Path) -> None:
    stat = os.fstat(2)
    assert stderr_is_journal({"JOURNAL_STREAM": f"{stat.st_dev}:{stat.st_ino}"})
    assert not stderr_is_journal({"JOURNAL_STREAM": f"{stat.st_dev}:{stat.st_ino + 1}"})
    assert not stderr_is_journal({})


@pytest.mark.skipif(Path("/run/systemd/journal/socket").exists(), reason="the journal of this machine would take the entry")
def test_a_process_started_as_systemd_does_logs_with_priorities(tmp_path: Path) -> None:
    path = tmp_path / "stderr"
    with path.open("wb") as stderr:
        stat = os.fstat(stderr.fileno())
        code = (
            "import logging; from ghest_rt.cli.console import set_up_logging; set_up_logging(False);"
            "logging.getLogger('ghest_rt').info('hello')"
        )
        variables = {**os.environ, "JOURNAL_STREAM": f"{stat.st_dev}:{stat.st_ino}"}
        subprocess.run([sys.executable, "-c", code], stderr=stderr, env=variables, check=True, timeout=30)
    assert path.read_text() == "<6>hello\n"
