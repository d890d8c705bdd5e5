"""Frames of the RealSense driver: which images leave, with which depth, under which number."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyrealsense2", reason="needs the extra realsense", exc_type=ImportError)

from ghest_drivers.clock import VirtualClock
from ghest_drivers.errors import BadDeviceData
from ghest_drivers.hardware.cameras.frame_queue import FrameQueue
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.hardware.realsense.assembly import FrameAssembler
from ghest_drivers.hardware.realsense.camera import RealsenseCamera
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.software import SoftwareRealsense
from ghest_drivers.hardware.realsense.source import ConnectedDevice
from ghest_drivers.hardware.realsense.timestamps import TimeDomain
from tests.hardware_cameras.realsense_rig import INFO, LONG_S, PERIOD_NS, SETTINGS, Rig, color_of, depth_of, opened


def test_images_arrive_unchanged_and_paired(rig: Rig) -> None:
    for k in range(5):
        rig.send_in_time(k)
    frames = rig.read_all()
    assert [frame.seq for frame in frames] == [0, 1, 2, 3, 4]
    for k, frame in enumerate(frames):
        np.testing.assert_array_equal(frame.color_rgb, color_of(k))
        np.testing.assert_array_equal(frame.depth_counts, depth_of(k))
        assert frame.t_device_ns == 1_000_000_000 + k * PERIOD_NS
        assert frame.t_arrival_ns == 6_000_000_000 + k * PERIOD_NS


def test_without_depth_colour_images_leave_at_once() -> None:
    with opened(replace(SETTINGS, depth=False)) as rig:
        for k in range(3):
            rig.send_in_time(k, streams="c")
            (frame,) = rig.read_all()
            assert frame.depth_counts is None
            np.testing.assert_array_equal(frame.color_rgb, color_of(k))
            assert frame.t_arrival_ns == 6_000_000_000 + k * PERIOD_NS
        assert rig.camera.info.depth == rig.camera.info.color
        assert rig.camera.stats.without_depth == 0


def test_depth_that_is_late_is_waited_for_and_depth_that_never_comes_is_not(rig: Rig) -> None:
    t0_ns = 1_000_000_000
    rig.send(0, t0_ns, streams="c")
    assert rig.read_all() == []
    rig.send(0, t0_ns + 3_000_000, streams="d")
    assert rig.read_all()[0].depth_counts is not None
    for k in (1, 2, 3):
        rig.clock.sleep_until_ns(rig.clock.now_ns() + PERIOD_NS)
        rig.send(k, t0_ns + k * PERIOD_NS, streams="c")
    (frame,) = rig.read_all()
    assert frame.seq == 1
    assert frame.depth_counts is None
    assert frame.t_depth_capture_ns == frame.t_capture_ns
    assert rig.camera.stats.without_depth == 1


def test_a_gap_in_the_device_numbers_is_a_gap_in_seq(rig: Rig) -> None:
    for k in (0, 1, 4, 5):
        rig.send_in_time(k)
    assert [frame.seq for frame in rig.read_all()] == [0, 1, 4, 5]
    assert rig.camera.stats.missing == 2


class _WrongFrame:
    """An SDK frame whose pixels are not what its profile promised."""

    def __init__(self, pixels: Any) -> None:
        self._pixels = pixels

    def get_data(self) -> Any:
        return self._pixels

    def get_profile(self) -> Any:
        return self

    def stream_type(self) -> Any:
        return rs.stream.color

    def get_timestamp(self) -> float:
        return 1000.0

    def get_frame_timestamp_domain(self) -> Any:
        return rs.timestamp_domain.hardware_clock

    def supports_frame_metadata(self, key: Any) -> bool:
        return False

    def keep(self) -> None:
        """Nothing to keep."""

    def get_frame_number(self) -> int:
        return 1


@pytest.mark.parametrize("pixels", [np.zeros((24, 32, 3), np.uint8), np.zeros((48, 64), np.uint16)])
def test_an_image_of_the_wrong_size_or_type_is_bad_data(pixels: Any) -> None:
    stats = CameraStats()
    queue = FrameQueue(4, stats)
    assembler = FrameAssembler(INFO, ConnectedDevice("S1", 0, lambda: 0), SETTINGS, queue, stats)
    assembler.take(_WrongFrame(pixels), 10**9)
    assembler.finish()
    with pytest.raises(BadDeviceData, match=r"color frame 1 is .* not uint8 \(48, 64, 3\)"):
        queue.get(0.0)
    assert stats.bad == 1


def test_a_reader_that_is_late_gets_the_newest_frames() -> None:
    with opened(replace(SETTINGS, queue_frames=4)) as rig:
        for k in range(10):
            rig.send_in_time(k)
        assert [frame.seq for frame in rig.read_all()] == [6, 7, 8, 9]
        assert rig.camera.stats.overruns == 6


def test_two_cameras_do_not_mix_their_frames() -> None:
    context = rs.context()
    devices = [SoftwareRealsense(replace(INFO, serial=serial)) for serial in ("S1", "S2")]
    cameras = []
    for device, serial in zip(devices, ("S1", "S2"), strict=True):
        device.device.add_to(context)
        source = ConnectedDevice(serial, 0, lambda: 0)
        cameras.append(RealsenseCamera(serial, source, SETTINGS, VirtualClock(10**9), context=lambda: context))
    for camera in cameras:
        camera.open()
    for k, device in enumerate(devices):
        device.send_depth(depth_of(k), 0, 10**9, TimeDomain.HARDWARE)
        device.send_color(color_of(k), 0, 10**9, TimeDomain.HARDWARE)
    for k, camera in enumerate(cameras):
        frame = camera.read(LONG_S)
        assert frame.info.name == f"S{k + 1}"
        np.testing.assert_array_equal(frame.color_rgb, color_of(k))
        camera.close()
