"""Coloured spots on something white, anywhere in the image: the candidates for the disks when nothing is known.

A pixel is coloured if its least channel is far below its greatest, both taken relative to the white of the light. What the
light's white is need only be known roughly here; the colour of every spot is then taken relative to its own surroundings,
which for a disk are the plate.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array

_COARSE_PX = 220  # images are thinned out to about this width
_SATURATION = 0.46
_DARK = 40  # greatest channel below which colour means nothing
_MAX_BLOBS = 32
_MIN_AREA = 5  # pixels of the thinned image
_MAX_SHARE = 0.08  # of the image
_RING_POINTS = 16
_RING_LIKE = 0.15
_RING_SHARE = 0.6
_KEY_STEPS = 6.0
_WHITE_SAMPLES = 1500
_BRIGHTER_SHARE = 0.025


@dataclass(frozen=True, slots=True, eq=False)
class Blobs:
    """Coloured spots.

    Attributes:
        centers_px: (n, 2) centroids in the full image.
        areas_px: (n,) areas in pixels of the full image.
        relative: (n, 3) colours, each channel divided by the surroundings'.
    """

    centers_px: Array
    areas_px: Array
    relative: Array


class BlobFinder:
    """Finds coloured spots on a white surround."""

    def __init__(self, width_px: int, height_px: int) -> None:
        self._step = max(1, round(width_px / _COARSE_PX))
        self._max_area = _MAX_SHARE * (width_px // self._step) * (height_px // self._step)
        angles = np.arange(_RING_POINTS) * (2 * np.pi / _RING_POINTS)
        self._ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self._tables: dict[tuple[int, int], NDArray[np.uint8]] = {}
        self._table((1.0, 1.0, 1.0))

    def bright_white(self, image: NDArray[np.uint8]) -> tuple[float, float, float]:
        """Return a guess at the light's white: the level that few pixels exceed, channel by channel."""
        step = max(1, round((image.shape[0] * image.shape[1] / _WHITE_SAMPLES) ** 0.5))
        channels = image[::step, ::step].reshape(-1, 3).T.copy()
        rank = channels.shape[1] - 1 - int(_BRIGHTER_SHARE * channels.shape[1])
        red, green, blue = np.partition(channels, rank, axis=1)[:, rank].tolist()
        return max(red, 1.0), max(green, 1.0), max(blue, 1.0)

    def find(self, image: NDArray[np.uint8], white: tuple[float, float, float]) -> Blobs | None:
        """Return the coloured spots of a (H, W, 3) image under a light of about this white; None if there are none."""
        step = self._step
        if step > 1:
            rows, columns = image.shape[0] // step, image.shape[1] // step
            whole = image[: rows * step, : columns * step]
            coarse = np.asarray(cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_NEAREST), dtype=np.uint8)
        else:
            coarse = image
        packed = np.asarray(cv2.cvtColor(coarse, cv2.COLOR_RGB2BGR565)).view(np.uint16)[..., 0]
        mask = np.take(self._table(white), packed)
        count, _, stats, centroids = cv2.connectedComponentsWithStats(mask, connectivity=8, ltype=cv2.CV_16U)
        if count < 2:
            return None
        left, top, width, height, area = (stats[1:, key].astype(np.float64) for key in range(5))
        shaped = (area >= _MIN_AREA) & (area <= self._max_area) & (area > 0.42 * width * height)
        shaped &= (width < 3.5 * height) & (height < 3.5 * width)
        shaped &= (left > 0) & (top > 0) & (left + width < mask.shape[1]) & (top + height < mask.shape[0])
        chosen = np.flatnonzero(shaped)
        if len(chosen) == 0:
            return None
        if len(chosen) > _MAX_BLOBS:
            chosen = chosen[np.argsort(area[chosen])[-_MAX_BLOBS:]]
        half = 0.5 * np.stack([width[chosen], height[chosen]], axis=1)
        centers = np.asarray(centroids[1:][chosen], dtype=np.float64)
        relative, white_around = self._relative_colors(coarse, centers, half)
        if not white_around.any():
            return None
        # The thinned image holds pixels 0, step, 2 step, ... of the full one.
        return Blobs(centers[white_around] * step, area[chosen][white_around] * (step * step), relative[white_around])

    def _relative_colors(self, coarse: NDArray[np.uint8], centers: Array, half: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return each spot's colour relative to its surroundings (n, 3), and whether these are of one colour."""
        ring = centers[:, None, :] + self._ring * (1.2 * half + 1.3)[:, None, :]
        inner = centers[:, None, :] + self._ring[::4] * (0.35 * half)[:, None, :]
        points = np.rint(np.concatenate([ring, inner], axis=1)).astype(np.intp)
        np.clip(points, 0, (coarse.shape[1] - 1, coarse.shape[0] - 1), out=points)
        colors = coarse[points[..., 1], points[..., 0]].astype(np.float64)
        around, within = colors[:, :_RING_POINTS], colors[:, _RING_POINTS:].mean(axis=1)
        median = np.maximum(np.sort(around, axis=1)[:, _RING_POINTS // 2], 1.0)
        alike = (np.abs(around - median[:, None, :]) < _RING_LIKE * median.max(axis=1)[:, None, None]).all(axis=2)
        return within / median, alike.mean(axis=1) >= _RING_SHARE

    def _table(self, white: tuple[float, float, float]) -> NDArray[np.uint8]:
        """Return 255 for every coloured 5-6-5 bit code under a light of this white, made once per colour of light."""
        key = (round(_KEY_STEPS * np.log2(white[0] / white[1])), round(_KEY_STEPS * np.log2(white[2] / white[1])))
        key = (min(max(key[0], -8), 8), min(max(key[1], -8), 8))
        if key not in self._tables:
            code = np.arange(1 << 16, dtype=np.uint32)
            red, green, blue = ((code >> 11) * 8 + 4.0, ((code >> 5) & 63) * 4 + 2.0, (code & 31) * 8 + 4.0)
            dark = np.maximum(np.maximum(red, green), blue) < _DARK
            balanced = (red / 2 ** (key[0] / _KEY_STEPS), green, blue / 2 ** (key[1] / _KEY_STEPS))
            least, most = np.minimum.reduce(balanced), np.maximum.reduce(balanced)
            self._tables[key] = np.where((least < (1.0 - _SATURATION) * most) & ~dark, np.uint8(255), np.uint8(0))
        return self._tables[key]
