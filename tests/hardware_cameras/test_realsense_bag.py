"""The RealSense driver on .bag files made by the SDK's own recorder."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pyrealsense2", reason="needs the extra realsense", exc_type=ImportError)

from ghest_drivers.clock import MonotonicClock, VirtualClock
from ghest_drivers.errors import DeviceLost, DeviceNotFound, EndOfStream
from ghest_drivers.hardware.realsense.camera import RealsenseCamera, bag_camera
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.source import BagFile, ConnectedDevice
from ghest_drivers.samples import RgbdFrame
from tests.drivers.blocked_call import BlockedCall
from tests.hardware_cameras.realsense_rig import (
    COLOR_FROM_DEPTH,
    INFO,
    LONG_S,
    PERIOD_NS,
    SETTINGS,
    color_of,
    depth_of,
    opened,
    record_bag,
)

_START_NS = 7_000_000_000


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record_bag(tmp_path_factory.mktemp("bag") / "recorded.bag", _START_NS, 30)


def _play(camera: RealsenseCamera, pause_s: float = 0.0) -> list[RgbdFrame]:
    camera.open()
    frames: list[RgbdFrame] = []
    with pytest.raises(EndOfStream):
        while True:
            frames.append(camera.read(LONG_S))
            time.sleep(pause_s)
    camera.close()
    return frames


@pytest.mark.parametrize("real_time", [True, False])
def test_a_bag_gives_back_every_frame_and_the_calibration(bag: Path, real_time: bool) -> None:
    camera = bag_camera("r0", bag, SETTINGS, MonotonicClock(), real_time=real_time)
    camera.open()
    info = camera.info
    frames = _play(camera)
    assert [frame.seq for frame in frames] == list(range(30))
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.color_rgb, color_of(k))
        np.testing.assert_array_equal(frame.depth_counts, depth_of(k))
    assert info.depth_unit_m == 0.000125
    np.testing.assert_allclose(info.color_from_depth, COLOR_FROM_DEPTH, atol=1e-7)
    np.testing.assert_allclose(info.color.distortion, INFO.color.distortion, rtol=1e-6)


def test_a_bag_read_as_fast_as_possible_waits_for_a_slow_reader_and_keeps_its_own_times(bag: Path) -> None:
    frames = _play(bag_camera("r0", bag, replace(SETTINGS, queue_frames=2), VirtualClock(), real_time=False), pause_s=0.01)
    times_ns = [frame.t_capture_ns for frame in frames]
    assert len(times_ns) == 30
    np.testing.assert_allclose(times_ns, [_START_NS + k * PERIOD_NS for k in range(30)], atol=2000)


def test_what_the_driver_records_to_a_bag_can_be_played_back(tmp_path: Path) -> None:
    path = tmp_path / "live.bag"
    with opened(replace(SETTINGS, record_bag=path)) as rig:
        for k in range(5):
            rig.send_in_time(k)
            time.sleep(0.01)
        assert len(rig.read_all()) == 5
    frames = _play(bag_camera("r0", path, SETTINGS, MonotonicClock(), real_time=False))
    assert [int(frame.color_rgb[0, 0, 0]) for frame in frames] == [0, 1, 2, 3, 4]
    assert [int(frame.depth_counts[0, 0]) for frame in frames if frame.depth_counts is not None] == list(range(1000, 1005))


@pytest.mark.parametrize("content", [None, b"", b"this is no bag"])
def test_a_bag_that_is_missing_or_foreign_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "x.bag"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DeviceNotFound, match=r"x\.bag"):
        RealsenseCamera("r0", BagFile(path), SETTINGS, VirtualClock()).open()


def test_unplugging_is_noticed_without_a_timeout(bag: Path) -> None:
    context = rs.context()
    played = context.load_device(str(bag))  # a device that can be taken out of a context
    source = ConnectedDevice("S1", 0, lambda: 0)
    camera = RealsenseCamera("r0", source, SETTINGS, MonotonicClock(), context=lambda: context)
    camera.open()
    camera.read(LONG_S)
    del played

    def read() -> None:
        while True:
            camera.read(LONG_S)

    reader = BlockedCall(read)
    context.unload_device(str(bag))
    error = reader.error(LONG_S)
    assert type(error) is DeviceLost
    assert "unplugged" in str(error)
    camera.close()
