"""The vendor's code may hang, crash or fall silent; the caller sees DeviceLost and opens again."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import BadDeviceData, DeviceLost, DeviceNotFound, DriverError, EndOfStream
from ghest_drivers.hardware.supervisor.camera import SupervisedCamera
from ghest_drivers.hardware.supervisor.link import Limits
from ghest_drivers.hardware.supervisor.protocol import BackendSpec
from tests.drivers.blocked_call import BlockedCall

_LONG_S = 30.0
_LIMITS = Limits(open_s=30.0, first_frame_s=10.0, silence_s=0.4, close_s=0.5)


@pytest.fixture(autouse=True)
def _importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent / "fakes"))


@contextmanager
def supervised(limits: Limits = _LIMITS, **settings: object) -> Iterator[SupervisedCamera]:
    camera = SupervisedCamera("r0", BackendSpec("ghest_fake_cameras", "FakeCamera", settings), MonotonicClock(), limits)
    yield camera
    camera.close()


def _read_until_error(camera: SupervisedCamera) -> tuple[list[int], DriverError]:
    seqs: list[int] = []
    while True:
        try:
            seqs.append(camera.read(_LONG_S).seq)
        except DriverError as error:
            return seqs, error


def _is_running(pid: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rpartition(")")[2].split()[0] != "Z"


def test_frames_cross_the_process_boundary_unchanged() -> None:
    with supervised(then="hang") as camera:
        camera.open()
        frames = [camera.read(_LONG_S) for _ in range(5)]
        assert [frame.seq for frame in frames] == [0, 1, 2, 3, 4]
        assert [frame.t_device_ns for frame in frames] == [0, 11, 22, 33, 44]
        for k, frame in enumerate(frames):
            assert (frame.color_rgb == k).all()
            assert frame.color_rgb.shape == (6, 8, 3)
            assert (frame.depth_counts is None) == bool(k % 2)
            if frame.depth_counts is not None:
                assert (frame.depth_counts == 1000 + k).all()
            assert (frame.t_arrival_ns - frame.t_capture_ns, frame.t_arrival_ns - frame.t_depth_capture_ns) == (1000, 2000)
            assert frame.info is camera.info
        assert camera.info.serial == "F1"


@pytest.mark.parametrize(
    ("then", "words"),
    [
        ("hang", "no frame for"),
        ("hang with the interpreter held", "no frame for"),
        ("silence", "no frame for"),
        ("segfault", "crashed (SIGSEGV)"),
        ("exit", "exit code 7"),
        ("lost", "the cable was pulled"),
        ("foreign error", "xioctl failed"),
    ],
)
def test_whatever_ends_the_stream_is_a_lost_device_after_the_last_frame(then: str, words: str) -> None:
    with supervised(then=then) as camera:
        camera.open()
        pid = camera.pid
        seqs, error = _read_until_error(camera)
        assert seqs == [0, 1, 2, 3, 4]
        assert isinstance(error, DeviceLost)
        assert words in str(error)
        with pytest.raises(DeviceLost):  # and it stays lost until it is opened again
            camera.read(0.0)
        camera.close()
        assert not _is_running(pid)
        assert camera.stats.lost >= 1


def test_a_lost_camera_streams_again_after_reopening_and_its_hardware_is_reset_first(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with supervised(then="segfault", log=str(log)) as camera:
        for _ in range(2):
            camera.open()
            seqs, _ = _read_until_error(camera)
            assert seqs == [0, 1, 2, 3, 4]
            camera.close()
    assert log.read_text().split() == ["open", "reset", "open"]


def test_a_camera_that_was_closed_in_peace_is_not_reset(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with supervised(then="silence", frames=10_000, log=str(log)) as camera:
        for _ in range(2):
            camera.open()
            camera.read(_LONG_S)
            camera.close()
    assert log.read_text().split() == ["open", "close", "open", "close"]


def test_a_process_killed_from_outside_is_a_lost_device() -> None:
    with supervised(then="silence", frames=10_000) as camera:
        camera.open()
        camera.read(_LONG_S)
        os.kill(camera.pid, signal.SIGKILL)
        _, error = _read_until_error(camera)
        assert isinstance(error, DeviceLost)
        assert "SIGKILL" in str(error)


def test_a_frozen_process_is_killed() -> None:
    with supervised(then="silence", frames=10_000) as camera:
        camera.open()
        camera.read(_LONG_S)
        pid = camera.pid
        os.kill(pid, signal.SIGSTOP)
        _, error = _read_until_error(camera)
        assert "no frame for" in str(error)
        camera.close()
        assert not _is_running(pid)


def test_the_end_of_a_finite_stream_is_passed_on_after_its_last_frame() -> None:
    with supervised(then="end", frames=6) as camera:
        camera.open()
        seqs, error = _read_until_error(camera)
        assert seqs == [0, 1, 2, 3, 4, 5]
        assert isinstance(error, EndOfStream)


def test_a_bad_frame_is_told_and_the_stream_goes_on() -> None:
    with supervised(then="bad data") as camera:
        camera.open()
        outcomes: list[object] = []
        for _ in range(5):
            try:
                outcomes.append(camera.read(_LONG_S).seq)
            except BadDeviceData as error:
                outcomes.append(str(error))
        assert sorted(map(str, outcomes)) == ["0", "1", "3", "4", "frame 2 is garbled"]


@pytest.mark.parametrize(
    ("on_open", "kind", "words"),
    [
        ("not found", DeviceNotFound, "no camera with serial F1"),
        ("segfault", DeviceLost, "crashed (SIGSEGV)"),
        ("hang", DeviceLost, "did not open within"),
    ],
)
def test_a_failure_to_open_is_told_and_leaves_nothing_behind(on_open: str, kind: type[DriverError], words: str) -> None:
    open_s = 1.0 if on_open == "hang" else 30.0
    with supervised(Limits(open_s=open_s), then="hang", on_open=on_open) as camera:
        with pytest.raises(kind, match=re.escape(words)):
            camera.open()
        with pytest.raises(DeviceLost):
            _ = camera.info


def test_closing_interrupts_an_open_that_hangs() -> None:
    with supervised(then="hang", on_open="hang") as camera:
        opening = BlockedCall(camera.open)
        assert opening.blocks(0.3)
        camera.close()
        assert type(opening.error(_LONG_S)) is DeviceLost


def test_a_close_that_hangs_is_cut_short() -> None:
    with supervised(then="hang in close", frames=10_000) as camera:
        camera.open()
        camera.read(_LONG_S)
        pid = camera.pid
        camera.close()
        assert not _is_running(pid)


def test_a_slow_reader_loses_the_oldest_frames_and_never_gets_a_torn_one() -> None:
    limits = Limits(first_frame_s=10.0, silence_s=5.0, slots=4)
    with supervised(limits, then="end", frames=400, period_s=0.0) as camera:
        camera.open()
        seqs: list[int] = []
        with pytest.raises(EndOfStream):
            while True:
                frame = camera.read(_LONG_S)
                assert (frame.color_rgb == frame.seq % 256).all()
                seqs.append(frame.seq)
                if len(seqs) == 1:
                    time.sleep(0.3)  # let the writer run away
        assert seqs == sorted(set(seqs))
        camera.close()
        assert len(seqs) + camera.stats.overwritten == 400


_ORPHAN = """
import sys, time
from ghest_drivers.clock import MonotonicClock
from ghest_drivers.hardware.supervisor.camera import SupervisedCamera
from ghest_drivers.hardware.supervisor.protocol import BackendSpec

if __name__ == "__main__":
    sys.path.insert(0, sys.argv[1])
    settings = {"then": "silence", "frames": 1_000_000}
    camera = SupervisedCamera("r0", BackendSpec("ghest_fake_cameras", "FakeCamera", settings), MonotonicClock())
    camera.open()
    print(camera.pid, flush=True)
    time.sleep(3600)
"""


def test_no_camera_process_outlives_a_service_that_was_killed(tmp_path: Path) -> None:
    script = tmp_path / "service.py"
    script.write_text(_ORPHAN)
    command = [sys.executable, str(script), str(Path(__file__).parent / "fakes")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as service:
        pid = int(service.stdout.readline()) if service.stdout else 0
        assert _is_running(pid)
        service.kill()
    deadline_s = time.monotonic() + _LONG_S
    while _is_running(pid) and time.monotonic() < deadline_s:
        time.sleep(0.02)
    assert not _is_running(pid)
