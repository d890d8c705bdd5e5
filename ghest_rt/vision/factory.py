"""Make the detector a station file asks for."""

from typing import Literal

from ghest_drivers.samples import CameraInfo
from ghest_rt.config.station import Marker
from ghest_rt.errors import BadInputError
from ghest_rt.vision.aruco import ArucoDetector
from ghest_rt.vision.detector import MarkerDetector
from ghest_rt.vision.paper import PaperDetector
from ghest_rt.vision.photometric.alignment import Alignment
from ghest_rt.vision.refined import RefinedDetector

Method = Literal["paper", "refined", "photometric", "aruco"]


def make_detector(
    method: Method, camera_name: str, marker_name: str, marker: Marker, info: CameraInfo, *, color_only: bool = False
) -> MarkerDetector:
    """Return a new detector of one marker for one camera.

    Args:
        method: `paper` (eq. (1)-(5)), `refined` (docs/vision.md), `photometric`
            (docs/photometric.md) or `aruco` (OpenCV's markers, for comparison).
        camera_name: Name of the camera in the station file, for the observations.
        marker_name: Name of the marker in the station file.
        marker: The marker's geometry and colours.
        info: The camera's calibration.
        color_only: Leave depth aside (`refined` and `photometric`; `aruco` never uses it).

    Raises:
        BadInputError: No such method, or it cannot do what was asked.
    """
    if method == "refined":
        return RefinedDetector(camera_name, marker_name, marker, info, color_only=color_only)
    if method == "photometric":
        return RefinedDetector(camera_name, marker_name, marker, info, color_only=color_only, polish=Alignment)
    if method == "aruco":
        return ArucoDetector(camera_name, marker_name, marker, info)
    if method == "paper":
        if color_only:
            raise BadInputError(
                f"cameras.{camera_name}.depth is false, and method paper cannot work from colour alone: eq. (3) reads every "
                "disk's position from depth; choose another method (estimator.method, --method)"
            )
        return PaperDetector(camera_name, marker_name, marker, info)
    raise BadInputError(f"no vision method {method!r}; choose one of paper, refined, aruco, photometric")
