"""An image that comes again is never taken for a new one."""

from dataclasses import replace

import numpy as np
import pytest

from ghest_drivers.errors import BadDeviceData, DeviceLost
from ghest_drivers.hardware.cameras.frozen import FrozenWatch
from ghest_drivers.interfaces import RgbdCamera
from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame

PINHOLE = Intrinsics(8, 200, 100, 100, 4, 100)
INFO = CameraInfo("r0", "m", "s", PINHOLE, PINHOLE, 1e-4, np.eye(4), 60.0)


class Scripted:
    """Delivers the colours given, one an image; later ones differ in one pixel of a row that is not looked at first."""

    def __init__(self, colors: list[int]) -> None:
        self.colors = list(colors)
        self.seq = 0

    @property
    def info(self) -> CameraInfo:
        return INFO

    def open(self) -> None:
        pass

    def read(self, timeout_s: float) -> RgbdFrame:
        image = np.zeros((200, 8, 3), np.uint8)
        image[77, 3, 1] = self.colors.pop(0)
        self.seq += 1
        frame = RgbdFrame(INFO, self.seq, image, None, 0, 0, 0, 0)
        return replace(frame, t_device_ns=self.seq, t_capture_ns=self.seq)

    def close(self) -> None:
        pass


def test_images_that_differ_in_one_pixel_pass() -> None:
    watch = FrozenWatch(Scripted([1, 2, 1, 3]))
    assert isinstance(watch, RgbdCamera)
    watch.open()
    assert [watch.read(0.0).seq for _ in range(4)] == [1, 2, 3, 4]


def test_the_image_before_is_refused_until_another_comes() -> None:
    watch = FrozenWatch(Scripted([1, 1, 1, 2]))
    watch.open()
    watch.read(0.0)
    for seq in (2, 3):
        with pytest.raises(BadDeviceData, match=f"image {seq} is the one before again"):
            watch.read(0.0)
    assert watch.read(0.0).seq == 4


def test_a_camera_that_stays_frozen_is_lost_and_opening_it_anew_starts_afresh() -> None:
    watch = FrozenWatch(Scripted([1] * 10), lost_after=3)
    watch.open()
    watch.read(0.0)
    for _ in range(2):
        with pytest.raises(BadDeviceData):
            watch.read(0.0)
    with pytest.raises(DeviceLost, match="frozen for 3 frames"):
        watch.read(0.0)
    watch.close()
    watch.open()
    assert watch.read(0.0).seq == 5
