"""What every camera backend promises (ghest_drivers.interfaces.RgbdCamera)."""

import contextlib
import itertools

import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import DeviceLost, EndOfStream, ReadTimeout
from ghest_drivers.interfaces import RgbdCamera
from ghest_drivers.samples import RgbdFrame
from tests.drivers.blocked_call import BlockedCall

_FRAMES = 5
_LONG_S = 20.0


def _frames(camera: RgbdCamera) -> list[RgbdFrame]:
    return [camera.read(_LONG_S) for _ in range(_FRAMES)]


def _exhaust(camera: RgbdCamera) -> None:
    with contextlib.suppress(ReadTimeout):
        while True:
            camera.read(0.3)


def test_it_has_info_only_while_open(camera: RgbdCamera) -> None:
    with pytest.raises(DeviceLost):
        _ = camera.info
    camera.open()
    info = camera.info
    assert info.name
    assert info.rate_hz > 0
    camera.close()
    with pytest.raises(DeviceLost):
        _ = camera.info


def test_opening_twice_does_not_disturb_the_stream(camera: RgbdCamera) -> None:
    camera.open()
    first = camera.read(_LONG_S)
    camera.open()
    assert camera.read(_LONG_S).seq > first.seq


def test_frames_are_numbered_and_stamped_in_order(camera: RgbdCamera) -> None:
    camera.open()
    frames = _frames(camera)
    for before, after in itertools.pairwise(frames):
        assert after.seq > before.seq
        assert after.t_capture_ns > before.t_capture_ns
        assert after.t_arrival_ns >= before.t_arrival_ns


def test_frames_are_captured_before_they_arrive_and_arrive_before_they_are_read(camera: RgbdCamera) -> None:
    clock = MonotonicClock()
    camera.open()
    for _ in range(_FRAMES):
        frame = camera.read(_LONG_S)
        assert 0 < frame.t_capture_ns <= frame.t_arrival_ns <= clock.now_ns()


def test_images_have_the_sizes_of_their_calibrations(camera: RgbdCamera) -> None:
    camera.open()
    for frame in _frames(camera):
        color, depth = frame.info.color, frame.info.depth
        assert frame.info.name == camera.info.name
        assert frame.color_rgb.shape == (color.height_px, color.width_px, 3)
        assert frame.color_rgb.dtype == "uint8"
        if frame.depth_counts is not None:
            assert frame.depth_counts.shape == (depth.height_px, depth.width_px)
            assert frame.depth_counts.dtype == "uint16"


def test_silence_is_a_timeout_and_not_an_end(silent_camera: RgbdCamera) -> None:
    silent_camera.open()
    _exhaust(silent_camera)
    for timeout_s in (0.0, 0.02):
        with pytest.raises(ReadTimeout):
            silent_camera.read(timeout_s)


def test_the_end_stays_the_end(ending_camera: RgbdCamera) -> None:
    ending_camera.open()
    with pytest.raises(EndOfStream):
        _exhaust(ending_camera)
    with pytest.raises(EndOfStream):
        ending_camera.read(_LONG_S)


def test_closing_is_harmless_at_any_time(camera: RgbdCamera) -> None:
    camera.close()
    camera.open()
    camera.read(_LONG_S)
    camera.close()
    camera.close()
    with pytest.raises(DeviceLost):
        camera.read(0.0)


def test_closing_wakes_a_blocked_read(silent_camera: RgbdCamera) -> None:
    silent_camera.open()
    _exhaust(silent_camera)
    reader = BlockedCall(lambda: silent_camera.read(50.0))
    assert reader.blocks(0.1)
    silent_camera.close()
    assert type(reader.error(10.0)) is DeviceLost


def test_it_streams_again_after_reopening(camera: RgbdCamera) -> None:
    camera.open()
    camera.read(_LONG_S)
    camera.close()
    camera.open()
    frame = camera.read(_LONG_S)
    assert frame.info.name == camera.info.name
