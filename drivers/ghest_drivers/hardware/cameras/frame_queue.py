"""Frames on their way from a vendor library's thread to the thread that reads the camera."""

import threading
from collections import deque

from ghest_drivers.errors import BadDeviceData, DeviceLost, DriverError, ReadTimeout
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.samples import RgbdFrame


class FrameQueue:
    """A bounded queue with one writer side and one reader.

    Args:
        capacity: Frames held at most.
        stats: Where dropped frames are counted.
        lossless: When full, `put` waits for room (recordings played back) instead of dropping the oldest frame (live).
    """

    def __init__(self, capacity: int, stats: CameraStats, *, lossless: bool = False) -> None:
        self._capacity = capacity
        self._lossless = lossless
        self._items: deque[RgbdFrame | BadDeviceData] = deque()
        self._changed = threading.Condition()
        self._end: DriverError | None = None
        self._closed = False
        self._stats = stats

    def put(self, item: RgbdFrame | BadDeviceData) -> None:
        """Add a frame, or the error that `get` raises in its place; does nothing once closed."""
        with self._changed:
            if self._lossless:
                self._changed.wait_for(lambda: self._closed or len(self._items) < self._capacity)
            if self._closed:
                return
            while len(self._items) >= self._capacity:
                self._items.popleft()
                self._stats.overruns += 1
            self._items.append(item)
            self._changed.notify_all()

    def get(self, timeout_s: float) -> RgbdFrame:
        """Block until the next frame.

        Raises:
            ReadTimeout: No frame within `timeout_s`.
            BadDeviceData: What arrived in its place cannot be used.
            DriverError: The error given to `end`, once all frames before it were read.
            DeviceLost: The queue was closed.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._items or self._end or self._closed, max(timeout_s, 0.0))
            if self._closed:
                raise DeviceLost("the camera is closed")
            if self._items:
                item = self._items.popleft()
                self._changed.notify_all()
                if isinstance(item, BadDeviceData):
                    raise item
                return item
            if self._end is not None:
                raise self._end
            raise ReadTimeout(f"no frame within {timeout_s:.3f} s")

    def end(self, error: DriverError) -> None:
        """Nothing more will come; `get` raises `error` after the last frame. The first call counts."""
        with self._changed:
            self._end = self._end or error
            self._changed.notify_all()

    def close(self) -> None:
        """Throw everything away and wake both sides."""
        with self._changed:
            self._closed = True
            self._items.clear()
            self._changed.notify_all()
