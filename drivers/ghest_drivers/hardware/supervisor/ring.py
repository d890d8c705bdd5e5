"""Frames through shared memory: one writing process, one reading process, no locks, nothing to be left locked by a crash.

Layout: the count of frames ever written, then slots. A slot is a header of 64-bit integers, the colour pixels and the
depth counts. The writer stamps a slot's header with the frame's index before and after it fills it; the reader copies and
then looks whether both stamps still are what it expects. A slow reader thus loses the oldest frames and never gets a torn one.
"""

from dataclasses import dataclass
from multiprocessing.shared_memory import SharedMemory

import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import CameraInfo, RgbdFrame

_ALIGN = 64
_BEGUN, _DONE, _SEQ, _HAS_DEPTH, _T_DEVICE, _T_ARRIVAL, _T_CAPTURE, _T_DEPTH = range(8)
_HEADER_BYTES = 8 * 8


@dataclass(frozen=True, slots=True)
class RingLayout:
    """Where everything lies.

    Attributes:
        color_shape: (H, W, 3), uint8.
        depth_shape: (h, w), uint16.
        slots: Frames held.
    """

    color_shape: tuple[int, int, int]
    depth_shape: tuple[int, int]
    slots: int

    @classmethod
    def of(cls, info: CameraInfo, slots: int) -> "RingLayout":
        """Return the layout for a camera's frames."""
        color, depth = info.color, info.depth
        return cls((color.height_px, color.width_px, 3), (depth.height_px, depth.width_px), slots)

    @property
    def depth_offset(self) -> int:
        """Bytes from a slot's start to its depth counts."""
        return _HEADER_BYTES + _aligned(int(np.prod(self.color_shape)))

    @property
    def slot_bytes(self) -> int:
        """Bytes from one slot to the next."""
        return self.depth_offset + _aligned(2 * int(np.prod(self.depth_shape)))

    @property
    def total_bytes(self) -> int:
        """Bytes of the whole ring."""
        return _ALIGN + self.slots * self.slot_bytes


class FrameRing:
    """One end of the ring. The creating end owns the memory.

    Args:
        layout: The same at both ends.
        name: Of existing shared memory; None to create it.
    """

    def __init__(self, layout: RingLayout, name: str | None = None) -> None:
        self._layout = layout
        self._owner = name is None
        self._memory = SharedMemory(name=name, create=name is None, size=layout.total_bytes)
        self._written: NDArray[np.int64] = np.ndarray((1,), np.int64, self._memory.buf)
        self._headers: list[NDArray[np.int64]] = []
        self._colors: list[NDArray[np.uint8]] = []
        self._depths: list[NDArray[np.uint16]] = []
        for slot in range(layout.slots):
            start = _ALIGN + slot * layout.slot_bytes
            buffer = self._memory.buf
            self._headers.append(np.ndarray((8,), np.int64, buffer, start))
            self._colors.append(np.ndarray(layout.color_shape, np.uint8, buffer, start + _HEADER_BYTES))
            self._depths.append(np.ndarray(layout.depth_shape, np.uint16, buffer, start + layout.depth_offset))
        self._next = 1
        self.overwritten = 0

    @property
    def name(self) -> str:
        """The shared memory's name, for the other end."""
        return self._memory.name

    def put(self, frame: RgbdFrame) -> None:
        """Write a frame over the oldest one.

        Raises:
            ValueError: Its images do not have the layout's shapes.
        """
        index = int(self._written[0]) + 1
        slot = index % self._layout.slots
        header = self._headers[slot]
        header[_BEGUN] = index
        if frame.color_rgb.shape != self._layout.color_shape:
            raise ValueError(f"colour image is {frame.color_rgb.shape}, not {self._layout.color_shape}")
        self._colors[slot][:] = frame.color_rgb
        if frame.depth_counts is not None:
            if frame.depth_counts.shape != self._layout.depth_shape:
                raise ValueError(f"depth image is {frame.depth_counts.shape}, not {self._layout.depth_shape}")
            self._depths[slot][:] = frame.depth_counts
        header[_SEQ:] = (
            frame.seq,
            frame.depth_counts is not None,
            frame.t_device_ns,
            frame.t_arrival_ns,
            frame.t_capture_ns,
            frame.t_depth_capture_ns,
        )
        header[_DONE] = index
        self._written[0] = index

    def get(self, info: CameraInfo) -> RgbdFrame | None:
        """Return a copy of the oldest frame not yet returned that is still there, or None."""
        while self._next <= (written := int(self._written[0])):
            oldest = max(self._next, written - self._layout.slots + 2)  # the slot after the newest may be in use
            self.overwritten += oldest - self._next
            self._next = oldest + 1
            frame = self._copy(oldest, info)
            if frame is not None:
                return frame
            self.overwritten += 1
        return None

    def _copy(self, index: int, info: CameraInfo) -> RgbdFrame | None:
        slot = index % self._layout.slots
        header = self._headers[slot]
        if header[_DONE] != index:
            return None
        seq, has_depth, t_device_ns, t_arrival_ns, t_capture_ns, t_depth_ns = (int(value) for value in header[_SEQ:])
        color_rgb = self._colors[slot].copy()
        depth_counts = self._depths[slot].copy() if has_depth else None
        if header[_BEGUN] != index:
            return None
        return RgbdFrame(info, seq, color_rgb, depth_counts, t_device_ns, t_arrival_ns, t_capture_ns, t_depth_ns)

    def close(self) -> None:
        """Let go of the memory; the owner removes it."""
        del self._written
        self._headers, self._colors, self._depths = [], [], []
        self._memory.close()
        if self._owner:
            self._memory.unlink()


def _aligned(size: int) -> int:
    return -(-size // _ALIGN) * _ALIGN
