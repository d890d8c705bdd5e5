"""Colour and depth images of one camera, paired by capture time. Pure: driven by what arrives, reads no clock.

Frame numbers cannot pair them: the streams of one camera count separately and drop separately.
"""

from collections import deque
from dataclasses import dataclass
from typing import Generic, TypeVar

from ghest_drivers.hardware.cameras.stats import CameraStats

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Image(Generic[T]):
    """One image of one stream.

    Attributes:
        t_capture_ns: Host time of mid-exposure.
        payload: The image itself; never looked at here.
    """

    t_capture_ns: int
    payload: T


@dataclass(frozen=True, slots=True)
class Pair(Generic[T]):
    """A colour image with the depth image nearest in time, or None."""

    color: Image[T]
    depth: Image[T] | None


class Pairer(Generic[T]):
    """Gives every colour image the depth image at most half a period away, each depth image used once.

    Colour images leave in order. One leaves without depth as soon as none can come any more: a later depth image has
    arrived, or `patience` newer colour images have while depth stays silent.

    Args:
        period_ns: Frame period.
        stats: Where unused and repeated images are counted.
        patience: Newer colour images to wait for.
    """

    def __init__(self, period_ns: int, stats: CameraStats, patience: int = 2) -> None:
        self._tolerance_ns = period_ns // 2
        self._patience = patience
        self._colors: deque[Image[T]] = deque()
        self._depths: deque[Image[T]] = deque()
        self._last_color_ns: int | None = None
        self._last_depth_ns: int | None = None
        self._stats = stats

    def add_color(self, image: Image[T]) -> list[Pair[T]]:
        """Take in a colour image; return what is complete now, oldest first."""
        if self._last_color_ns is not None and image.t_capture_ns <= self._last_color_ns:
            self._stats.repeated += 1
            return []
        self._last_color_ns = image.t_capture_ns
        self._colors.append(image)
        return self._complete()

    def add_depth(self, image: Image[T]) -> list[Pair[T]]:
        """Take in a depth image; return what is complete now, oldest first."""
        if self._last_depth_ns is not None and image.t_capture_ns <= self._last_depth_ns:
            self._stats.repeated += 1
            return []
        self._last_depth_ns = image.t_capture_ns
        self._depths.append(image)
        pairs = self._complete()
        while len(self._depths) > self._patience + 1:  # colour is silent
            self._drop_depth()
        return pairs

    def flush(self) -> list[Pair[T]]:
        """Return the colour images still waiting, without depth: the streams have ended."""
        pairs: list[Pair[T]] = [Pair(color, None) for color in self._colors]
        self._colors.clear()
        return pairs

    def _complete(self) -> list[Pair[T]]:
        pairs: list[Pair[T]] = []
        while self._colors:
            color = self._colors[0]
            while self._depths and self._depths[0].t_capture_ns < color.t_capture_ns - self._tolerance_ns:
                self._drop_depth()
            depth: Image[T] | None = None
            if self._depths:
                if self._depths[0].t_capture_ns <= color.t_capture_ns + self._tolerance_ns:
                    depth = self._depths.popleft()
            elif len(self._colors) <= self._patience:
                break
            self._colors.popleft()
            pairs.append(Pair(color, depth))
        return pairs

    def _drop_depth(self) -> None:
        self._depths.popleft()
        self._stats.depth_unused += 1
