"""The replay's own behaviour, beyond what every backend promises."""

import asyncio
import threading
from collections.abc import Iterator

import numpy as np
import pytest

from ghest_drivers.clock import Clock, MonotonicClock, VirtualClock
from ghest_drivers.errors import DeviceLost, DeviceNotFound, EndOfStream
from ghest_drivers.replay import ReplayPlayer
from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, Intrinsics, RgbdFrame
from tests.drivers.blocked_call import BlockedCall

_INTRINSICS = Intrinsics(2, 2, 1, 1, 0.5, 0.5)
_INFO = CameraInfo("r0", "test", "1", _INTRINSICS, _INTRINSICS, 0.001, np.eye(4), 60.0)
_ENCODERS = EncoderInfo("encoders", ("j0",))
_FIRST_NS = 10**18 + 7  # beyond what a float holds exactly
_MS = 1_000_000


def _frame(k: int, after_ms: int) -> RgbdFrame:
    t_ns = _FIRST_NS + after_ms * _MS
    image = np.zeros((2, 2, 3), np.uint8)
    return RgbdFrame(_INFO, k, image, None, 123 + k, t_ns, t_ns - 20 * _MS, t_ns - 21 * _MS)


def _sample(k: int, after_ms: int) -> EncoderSample:
    t_ns = _FIRST_NS + after_ms * _MS
    return EncoderSample(k, np.array([float(k)]), 5, t_ns, t_ns - 2 * _MS)


def _player(events: object, clock: Clock, speed: float = 1.0) -> ReplayPlayer:
    return ReplayPlayer(events, {"r0": _INFO}, _ENCODERS, clock, speed)  # type: ignore[arg-type]


def test_times_are_moved_to_the_clock_and_ages_kept() -> None:
    clock = VirtualClock(5_000)
    player = _player([_frame(0, 0), _frame(1, 15), _frame(2, 31)], clock)
    camera = player.camera("r0")
    camera.open()
    frames = [camera.read(1.0) for _ in range(3)]
    player.close()
    assert [frame.t_arrival_ns for frame in frames] == [5_000, 5_000 + 15 * _MS, 5_000 + 31 * _MS]
    assert [frame.t_arrival_ns - frame.t_capture_ns for frame in frames] == [20 * _MS] * 3
    assert [frame.t_arrival_ns - frame.t_depth_capture_ns for frame in frames] == [21 * _MS] * 3
    assert [frame.t_device_ns for frame in frames] == [123, 124, 125]
    assert clock.now_ns() == frames[-1].t_arrival_ns


def test_clock_times_lead_back_to_the_recording_exactly() -> None:
    player = _player([_frame(0, 0), _frame(1, 15)], VirtualClock(99))
    assert player.offset_ns is None
    with pytest.raises(ValueError, match="not fixed"):
        player.to_recording_ns(0)
    camera = player.camera("r0")
    camera.open()
    frames = [camera.read(1.0) for _ in range(2)]
    player.close()
    assert player.offset_ns is not None
    assert [frame.t_capture_ns - player.offset_ns for frame in frames] == [_FIRST_NS - 20 * _MS, _FIRST_NS - 5 * _MS]
    assert [player.to_recording_ns(frame.t_arrival_ns) for frame in frames] == [_FIRST_NS, _FIRST_NS + 15 * _MS]


@pytest.mark.parametrize("speed", [0.5, 4.0])
def test_speed_stretches_the_time_between_samples(speed: float) -> None:
    player = _player([_frame(0, 0), _frame(1, 100)], VirtualClock(), speed)
    camera = player.camera("r0")
    camera.open()
    first, second = camera.read(1.0), camera.read(1.0)
    player.close()
    assert second.t_arrival_ns - first.t_arrival_ns == round(100 * _MS / speed)
    assert player.to_recording_ns(second.t_arrival_ns) == _FIRST_NS + 100 * _MS


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_speeds_are_refused(speed: float) -> None:
    with pytest.raises(ValueError, match="speed"):
        _player([], VirtualClock(), speed)


def test_a_long_recording_is_played_whole_on_a_virtual_clock() -> None:
    player = _player([_frame(k, 16 * k) for k in range(500)], VirtualClock())
    camera = player.camera("r0")
    camera.open()
    read = []
    with pytest.raises(EndOfStream):
        while True:
            read.append(camera.read(1.0).seq)
    player.close()
    assert read == list(range(500))


def test_the_recording_is_not_read_far_ahead() -> None:
    taken = []

    def events() -> Iterator[RgbdFrame]:
        for k in range(1000):
            taken.append(k)
            yield _frame(k, 100 * k)

    player = _player(events(), MonotonicClock())
    camera = player.camera("r0")
    camera.open()
    camera.read(10.0)
    camera.read(10.0)
    player.close()
    assert len(taken) < 50


def test_what_nobody_reads_gives_way_to_what_is_new() -> None:
    clock = VirtualClock()
    fed = threading.Event()

    def events() -> Iterator[RgbdFrame]:
        for k in range(200):
            if k == 150:
                fed.set()
            yield _frame(k, 10 * k)

    player = _player(events(), clock)
    camera = player.camera("r0")
    camera.open()
    camera.read(1.0)
    clock.sleep_until_ns(1_500 * _MS)
    assert fed.wait(10.0)
    late = camera.read(1.0)
    player.close()
    assert late.seq > 100


def test_devices_nobody_opens_do_not_hold_up_the_others() -> None:
    events: list[object] = []
    for k in range(300):
        events += [_frame(k, 10 * k), _sample(k, 10 * k)]
    player = _player(events, VirtualClock())
    camera = player.camera("r0")
    camera.open()
    seqs = [camera.read(1.0).seq for _ in range(300)]
    player.close()
    assert seqs == list(range(300))


async def test_camera_and_encoders_share_one_axis() -> None:
    player = _player([_frame(0, 0), _sample(0, 4), _sample(1, 9)], MonotonicClock())
    camera, encoders = player.camera("r0"), player.encoders()
    camera.open()
    await encoders.open()
    frame = camera.read(10.0)
    samples = [await encoders.read(10.0) for _ in range(2)]
    player.close()
    assert [sample.t_arrival_ns - frame.t_arrival_ns for sample in samples] == [4 * _MS, 9 * _MS]
    assert [sample.t_arrival_ns - sample.t_capture_ns for sample in samples] == [2 * _MS] * 2


def test_other_events_go_to_the_callback() -> None:
    others: list[object] = []
    events = ["truth 0", _frame(0, 0), "truth 1"]
    player = ReplayPlayer(events, {"r0": _INFO}, _ENCODERS, VirtualClock(), on_other=others.append)
    camera = player.camera("r0")
    camera.open()
    camera.read(1.0)
    with pytest.raises(EndOfStream):
        camera.read(1.0)
    player.close()
    assert others == ["truth 0", "truth 1"]


def test_a_recording_that_breaks_off_is_a_lost_device_after_its_last_sample() -> None:
    def events() -> Iterator[RgbdFrame]:
        yield _frame(0, 0)
        raise RuntimeError("the disk is gone")

    player = _player(events(), VirtualClock())
    camera = player.camera("r0")
    camera.open()
    assert camera.read(1.0).seq == 0
    with pytest.raises(DeviceLost, match="the disk is gone"):
        camera.read(1.0)
    player.close()


def test_unknown_cameras_are_named() -> None:
    with pytest.raises(DeviceNotFound, match=r"no camera r7; it has r0"):
        _player([], VirtualClock()).camera("r7")


def test_closing_the_player_wakes_readers_and_ends_its_thread() -> None:
    player = _player([_frame(0, 0), _frame(1, 60_000)], MonotonicClock())
    camera = player.camera("r0")
    camera.open()
    camera.read(10.0)
    reader = BlockedCall(lambda: camera.read(50.0))
    player.close()
    assert type(reader.error(10.0)) is DeviceLost
    assert "replay-feeder" not in [thread.name for thread in threading.enumerate()]
    with pytest.raises(DeviceNotFound):
        camera.open()


async def test_a_slow_clock_does_not_hold_up_the_event_loop() -> None:
    class SlowClock(MonotonicClock):
        """Runs at a tenth of the host's pace."""

        def now_ns(self) -> int:
            return super().now_ns() // 10

        def sleep_until_ns(self, t_ns: int) -> None:
            super().sleep_until_ns(t_ns * 10)

    player = _player([_sample(0, 0), _sample(1, 30)], SlowClock())
    encoders = player.encoders()
    await encoders.open()
    await encoders.read(10.0)
    reading = asyncio.ensure_future(encoders.read(10.0))
    turns = 0
    while not reading.done():
        await asyncio.sleep(0.001)
        turns += 1
    await encoders.close()
    player.close()
    assert (await reading).seq == 1
    assert turns > 20  # of 300; two or three if the loop were held up
