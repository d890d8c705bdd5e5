"""The end of the process, or of the disk, costs the last second at most and leaves a file that can be read."""

import os
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from ghest_rt.recording.problems import Skip
from ghest_rt.recording.reader import Recording
from tests.recording_live.feeding import FEEDER, RATE_HZ, ROOT, feed_until_killed, newest


def only_recording(folder: Path) -> Recording:
    (path,) = folder.glob("*.mcap")
    return Recording(path)


def test_kill_9_loses_at_most_the_last_second(tmp_path: Path) -> None:
    last = feed_until_killed(tmp_path, at=250)
    recording = only_recording(tmp_path)
    assert min(newest(recording).values()) >= last - RATE_HZ
    assert Skip.TRUNCATED in [problem.skip for problem in recording.problems]


def run_until_full(folder: Path, *arguments: object) -> list[str]:
    """Record for 3 s; return what the feeder said."""
    ended = subprocess.run(
        [*FEEDER, folder, "--seconds", "3", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=60,
        check=True,
    )
    assert ended.stderr == ""
    return ended.stdout.splitlines()


def check_full(folder: Path, lines: list[str], reason: str) -> None:
    *progress, end = lines
    assert len(progress) == 3 * RATE_HZ  # the feeder, as the service, goes on to its end
    failed = next(k for k, line in enumerate(progress) if line.endswith("failed"))
    assert failed < 2.5 * RATE_HZ
    _, dropped, *why = end.split(" ")
    assert int(dropped) > 0
    assert reason in " ".join(why)
    assert min(newest(only_recording(folder)).values()) >= failed - RATE_HZ


def test_a_file_that_may_not_grow_any_more(tmp_path: Path) -> None:
    check_full(tmp_path, run_until_full(tmp_path, "--max-file-bytes", 20_000_000), "File too large")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 20 MB."""
    if (
        os.geteuid() != 0
        or subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=20m", "none", tmp_path], capture_output=True, check=False
        ).returncode
    ):
        pytest.skip("mounting a small file system needs the rights of root")
    yield tmp_path
    subprocess.run(["umount", tmp_path], check=True)


def test_a_full_disk(small_disk: Path) -> None:
    check_full(small_disk, run_until_full(small_disk), "No space left on device")


def test_signals_still_end_the_process(tmp_path: Path) -> None:
    """Threads of the recorder hold nothing up: an interrupt in the middle ends the process at once."""
    feeder = subprocess.Popen([*FEEDER, tmp_path], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    assert feeder.stdout is not None
    feeder.stdout.readline()
    feeder.send_signal(signal.SIGINT)
    feeder.communicate(timeout=20)
    assert feeder.returncode != 0
