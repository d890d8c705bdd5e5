"""Refuse images that do not belong to the camera a detector was made for."""

import numpy as np

from ghest_drivers.samples import CameraInfo, RgbdFrame
from ghest_rt.errors import BadInputError


def check_frame(frame: RgbdFrame, info: CameraInfo) -> None:
    """Check size and type of both images of `frame` against `info`.

    Raises:
        BadInputError: Size or type differ; names the camera, the frame, what came and what was expected.
    """
    color = frame.color_rgb
    wanted = (info.color.height_px, info.color.width_px, 3)
    if color.shape != wanted or color.dtype != np.uint8:
        _refuse(frame, info, "colour", color.shape, color.dtype.name, wanted, "uint8")
    depth = frame.depth_counts
    if depth is not None:
        size = (info.depth.height_px, info.depth.width_px)
        if depth.shape != size or depth.dtype != np.uint16:
            _refuse(frame, info, "depth", depth.shape, depth.dtype.name, size, "uint16")


def _refuse(
    frame: RgbdFrame,
    info: CameraInfo,
    which: str,
    got: tuple[int, ...],
    got_type: str,
    wanted: tuple[int, ...],
    wanted_type: str,
) -> None:
    raise BadInputError(
        f"camera {info.name}, frame {frame.seq}: the {which} image is {got_type} {got}, but the camera's calibration says "
        f"{wanted_type} {wanted} (height, width, …); record or configure the calibration of the resolution in use"
    )
