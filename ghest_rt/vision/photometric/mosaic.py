"""Which colour of a pixel was measured and which were interpolated, found out from the image itself.

A sensor with a Bayer mosaic measures one colour per pixel. What is interpolated is smoother than what is measured: it has less
of the detail that is left when the mean of the neighbours is taken off. So on the lattice of pixels that measured a colour its
detail is stronger than on the others, however the rest was interpolated. Interpolated values hold no information of their
own; they blur edges, and make the noise of neighbours alike.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

_FRAMES = 6  # from which it is found out
_STRONGER = 1.8  # by which factor the squared detail must be stronger where a colour was measured
_LEAST_SIDE_PX = 16
_MAX_DETAIL = 40.0  # of 255: beyond that a pixel says more about the scene than about the sensor
_NEIGHBOURS = np.array([[0.0, 0.25, 0.0], [0.25, 0.0, 0.25], [0.0, 0.25, 0.0]], dtype=np.float32)
_AROUND = np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]], dtype=np.float32) / np.float32(8.0)


class MosaicSense:
    """Learns from the first frames whether the camera interpolates colours, and in which pattern.

    Attributes:
        channels: (2, 2) the channel measured at pixels of even and odd rows and columns; None if all are, or unknown.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.channels: NDArray[np.intp] | None = None
        self._detail = np.zeros((3, 2, 2))
        self._frames = 0

    @property
    def settled(self) -> bool:
        """Whether more images would teach nothing."""
        return self._frames >= _FRAMES

    def learn(self, image: NDArray[np.uint8], rows: tuple[int, int], columns: tuple[int, int]) -> None:
        """Look at a rectangle (first row, last row + 1; the same of columns) of one more image, as long as that is of use."""
        if self._frames >= _FRAMES:
            return
        height, width = image.shape[:2]
        top, left = (max(first, 0) & ~1 for first in (rows[0], columns[0]))
        bottom, right = min(rows[1], height) & ~1, min(columns[1], width) & ~1
        if min(bottom - top, right - left) < _LEAST_SIDE_PX:
            return
        patch = image[top:bottom, left:right].astype(np.float32)
        for channel, kernel in enumerate((_AROUND, _NEIGHBOURS, _AROUND)):
            plane = np.ascontiguousarray(patch[..., channel])
            detail = np.abs(plane - cv2.filter2D(plane, -1, kernel))[2:-2, 2:-2]
            np.minimum(detail, _MAX_DETAIL, out=detail)
            for row in range(2):
                for column in range(2):
                    self._detail[channel, row, column] += float(np.mean(np.square(detail[row::2, column::2])))
        self._frames += 1
        self.channels = self._pattern()

    def _pattern(self) -> NDArray[np.intp] | None:
        """Return the pattern in which every channel is strongest where it would be measured; None if none is plain."""
        for green in range(2):  # green on the pixels where row + column has this parity
            for red_row in range(2):
                channels = np.ones((2, 2), dtype=np.intp)
                red = red_row, (red_row + green + 1) % 2
                blue = 1 - red[0], 1 - red[1]
                channels[red], channels[blue] = 0, 2
                if all(self._stands_out(channel, channels == channel) for channel in range(3)):
                    return channels
        return None

    def _stands_out(self, channel: int, measured: NDArray[np.bool_]) -> bool:
        detail = self._detail[channel]
        return float(detail[measured].min()) > _STRONGER * float(detail[~measured].max())
