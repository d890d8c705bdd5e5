"""Refuse images that do not belong to the camera a detector was made for."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import CameraInfo, RgbdFrame
from ghest_rt.errors import BadInputError


def check_frame(frame: RgbdFrame, info: CameraInfo) -> None:
    """Check size and type of both images of `frame` against `info`.

    Raises:
        BadInputError: Size or type differ; names the camera, the frame, what came and what was expected.
    """
    _check(frame, info, "colour", frame.color_rgb, (info.color.height_px, info.color.width_px, 3), np.dtype(np.uint8))
    if frame.depth_counts is not None:
        _check(frame, info, "depth", frame.depth_counts, (info.depth.height_px, info.depth.width_px), np.dtype(np.uint16))


def _check(  # noqa: PLR0917
    frame: RgbdFrame, info: CameraInfo, which: str, image: NDArray[Any], shape: tuple[int, ...], dtype: np.dtype[Any]
) -> None:
    if image.shape != shape or image.dtype != dtype:
        raise BadInputError(
            f"camera {info.name}, frame {frame.seq}: the {which} image is {image.dtype} {image.shape}, but the camera's "
            f"calibration says {dtype} {shape} (height, width, …); use the calibration of the resolution in use"
        )
