"""A camera that delivers the same image again and again, as hung firmware and full USB buffers do, under new time stamps."""

from dataclasses import replace

import numpy as np

from ghest_drivers.errors import BadDeviceData, DeviceLost
from ghest_drivers.interfaces import RgbdCamera, TellsVitals
from ghest_drivers.samples import CameraInfo, DeviceVitals, RgbdFrame

_LOST_AFTER = 30


class FrozenWatch:
    """An `RgbdCamera`: another one, whose repeated images are refused and never taken for new ones.

    Two images of a real sensor are never the same to the last bit: its noise sees to that. Not for ideal simulated sensors.

    Attributes:
        camera: The camera watched.

    Args:
        camera: The camera to watch.
        lost_after: So many repeated images in a row mean that the device hangs: `read` raises DeviceLost.
    """

    def __init__(self, camera: RgbdCamera, lost_after: int = _LOST_AFTER) -> None:
        self.camera = camera
        self._lost_after = lost_after
        self._last: RgbdFrame | None = None
        self._repeated = 0
        self._refused = 0

    @property
    def info(self) -> CameraInfo:
        """See `RgbdCamera.info`."""
        return self.camera.info

    def vitals(self) -> DeviceVitals:
        """See `TellsVitals.vitals`."""
        inner = self.camera.vitals() if isinstance(self.camera, TellsVitals) else DeviceVitals()
        return replace(inner, refused={**inner.refused, "frozen": self._refused})

    def open(self) -> None:
        """See `RgbdCamera.open`."""
        self._last, self._repeated = None, 0
        self.camera.open()

    def read(self, timeout_s: float) -> RgbdFrame:
        """See `RgbdCamera.read`.

        Raises:
            BadDeviceData: The image is the one before, to the last bit.
            DeviceLost: So have been the last `lost_after` ones, beside the camera's own reasons.
        """
        frame = self.camera.read(timeout_s)
        last, self._last = self._last, frame
        if last is None or not _same_pixels(last, frame):
            self._repeated = 0
            return frame
        self._repeated += 1
        self._refused += 1
        if self._repeated >= self._lost_after:
            raise DeviceLost(f"camera {frame.info.name}: the image has been frozen for {self._repeated} frames")
        raise BadDeviceData(f"camera {frame.info.name}: image {frame.seq} is the one before again, to the last bit")

    def close(self) -> None:
        """See `RgbdCamera.close`."""
        self.camera.close()


def _same_pixels(a: RgbdFrame, b: RgbdFrame) -> bool:
    """Compare a few rows first: those of two proper images differ."""
    some = np.array_equal(a.color_rgb[::64], b.color_rgb[::64])
    return some and np.array_equal(a.color_rgb, b.color_rgb)
