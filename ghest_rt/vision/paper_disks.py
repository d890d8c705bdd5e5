"""Step (1) of the paper's 3.3.1: where the disks are in the colour image, in whole pixels."""

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
_MIN_BLOB_PX = 4


def segment_colors(color_rgb: Image, disk_rgb: NDArray[np.float64], tolerance: int) -> list[Image]:
    """Step (1a), colour segmentation: I^sc as one mask per disk colour.

    Args:
        color_rgb: (H, W, 3) colour image I^c.
        disk_rgb: (n, 3) nominal colours of the disks.
        tolerance: How far each channel may be from the nominal colour, fixed.

    Returns:
        n masks (H, W), 255 where the image has that disk's colour.
    """
    masks = []
    for rgb in disk_rgb:
        low = tuple(float(max(c - tolerance, 0)) for c in rgb)
        high = tuple(float(min(c + tolerance, 255)) for c in rgb)
        masks.append(np.asarray(cv2.inRange(color_rgb, low, high), dtype=np.uint8))
    return masks


def blob_center(mask: Image) -> tuple[int, int] | None:
    """Steps (1b) and (1c): blob extraction and the centre of the blob's bounding box.

    Args:
        mask: (H, W), not zero where the image has one disk's colour.

    Returns:
        The centre (u, v) in Z^2 of the bounding box of the largest connected region (8 neighbours), halves rounded down;
        None if no region has at least 4 pixels.
    """
    count, _, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    if count < 2:
        return None
    blob = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    if stats[blob, cv2.CC_STAT_AREA] < _MIN_BLOB_PX:
        return None
    left, top, width, height = (int(stats[blob, key]) for key in range(4))
    return left + (width - 1) // 2, top + (height - 1) // 2
