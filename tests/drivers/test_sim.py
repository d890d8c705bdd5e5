"""The simulated devices' own behaviour, beyond what every backend promises."""

import threading
from collections.abc import Callable

import numpy as np
import pytest

from ghest_drivers.clock import VirtualClock
from ghest_drivers.errors import EndOfStream
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, Intrinsics, RgbdFrame
from ghest_drivers.sim import SimCamera, SimEncoders

_MS = 1_000_000
_INTRINSICS = Intrinsics(2, 2, 1, 1, 0.5, 0.5)
_INFO = CameraInfo("r0", "test", "1", _INTRINSICS, _INTRINSICS, 0.001, np.eye(4), 100.0)


class _World:
    """100 Hz, 5 ms of latency; `work` is done for every frame."""

    def __init__(self, work: Callable[[], None] = lambda: None) -> None:
        self.work = work

    def camera_info(self, name: str) -> CameraInfo:
        return _INFO

    def frame(self, name: str, k: int) -> RgbdFrame | None:
        self.work()
        t_ns = 10 * _MS * k
        image = np.zeros((2, 2, 3), np.uint8)
        return RgbdFrame(_INFO, k, image, None, t_ns, t_ns + 5 * _MS, t_ns, t_ns) if k < 20 else None

    def encoder_info(self) -> EncoderInfo:
        return EncoderInfo("encoders", ("j0",))

    def encoder_sample(self, k: int) -> EncoderSample | None:
        return EncoderSample(k, np.zeros(1), 0, 10 * _MS * k + _MS, 10 * _MS * k) if k < 20 else None


def test_world_time_is_shown_from_the_start_time_on() -> None:
    clock = VirtualClock(1_000 * _MS)
    camera = SimCamera(_World(), "r0", clock, 1_000 * _MS)
    camera.open()
    frames = [camera.read(1.0) for _ in range(3)]
    assert [frame.t_capture_ns for frame in frames] == [1_000 * _MS, 1_010 * _MS, 1_020 * _MS]
    assert [frame.t_depth_capture_ns for frame in frames] == [1_000 * _MS, 1_010 * _MS, 1_020 * _MS]
    assert clock.now_ns() == frames[-1].t_arrival_ns == 1_025 * _MS


def test_a_world_too_slow_for_the_clock_loses_frames_and_not_time() -> None:
    clock = VirtualClock()
    camera = SimCamera(_World(lambda: clock.sleep_until_ns(clock.now_ns() + 25 * _MS)), "r0", clock, 0)
    camera.open()
    read = []
    with pytest.raises(EndOfStream):
        while True:
            frame = camera.read(1.0)
            read.append(frame.seq)
            assert clock.now_ns() - frame.t_arrival_ns <= 40 * _MS
    assert len(read) < 10
    assert read == sorted(set(read))


async def test_encoder_samples_that_were_due_before_opening_have_gone_by_and_the_others_come_however_late() -> None:
    clock = VirtualClock(95 * _MS)
    encoders = SimEncoders(_World(), clock, 0)
    await encoders.open()
    read = [(await encoders.read(1.0)).seq]
    clock.sleep_until_ns(500 * _MS)
    with pytest.raises(EndOfStream):
        while True:
            read.append((await encoders.read(1.0)).seq)
    assert read == list(range(10, 20))


async def test_closed_encoders_leave_no_thread_behind() -> None:
    before = set(threading.enumerate())
    encoders = SimEncoders(_World(), VirtualClock(), 0)
    await encoders.open()
    await encoders.read(1.0)
    started = [thread for thread in threading.enumerate() if thread not in before]
    await encoders.close()
    assert started
    for thread in started:
        thread.join(5.0)
    assert not any(thread.is_alive() for thread in started)
