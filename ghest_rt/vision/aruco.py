"""Method `aruco`: the rival, OpenCV's ArUco markers, to be compared with on scenes rendered with such a marker."""

import cv2
import numpy as np

from ghest_drivers.samples import CameraInfo, RgbdFrame
from ghest_rt.config.station import Marker
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import transform
from ghest_rt.messages.results import MarkerObservation, MarkerStatus
from ghest_rt.vision.checks import check_frame

_IDS = {"m0": 0, "m1": 1}


class ArucoDetector:
    """DICT_4X4_50, id 0 for m0 and 1 for m1, default detector parameters, solved by SOLVEPNP_IPPE_SQUARE; colour only.

    The black square's side is that of the square around our disks, 2 (a + r). Seen from the front (from +z) the code image
    is upright with x to the right and y up: its top left corner is at (-s/2, +s/2), its top right one at (+s/2, +s/2).
    """

    def __init__(self, camera_name: str, marker_name: str, marker: Marker, info: CameraInfo) -> None:
        if marker_name not in _IDS:
            raise BadInputError(f"method aruco knows the markers {', '.join(_IDS)}, not {marker_name}")
        self._camera = camera_name
        self._marker = marker_name
        self._info = info
        self._id = _IDS[marker_name]
        half_m = marker.half_spacing_m + marker.disk_radius_m
        self._corners_m = np.array([[-half_m, half_m, 0], [half_m, half_m, 0], [half_m, -half_m, 0], [-half_m, -half_m, 0]])
        self._detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
        self._distortion = np.array(info.color.distortion)

    def set_parameters(self, parameters: cv2.aruco.DetectorParameters) -> None:
        """Use other detector parameters than OpenCV's default ones."""
        self._detector.setDetectorParameters(parameters)

    def detect(self, frame: RgbdFrame) -> MarkerObservation:
        """Return the marker's pose, without covariance; status OK, since needing no depth is this method's normal case.

        Raises:
            BadInputError: The images are not those of the camera that the detector was made for.
        """
        check_frame(frame, self._info)
        corners, ids, _ = self._detector.detectMarkers(cv2.cvtColor(frame.color_rgb, cv2.COLOR_RGB2GRAY))
        known = [] if ids is None else np.ravel(ids).tolist()
        found = [quad for quad, marker_id in zip(corners, known, strict=True) if marker_id == self._id]
        status = MarkerStatus.NOT_FOUND
        pose = None
        if len(found) == 1:
            solved, rotvec_rad, position_m = cv2.solvePnP(
                self._corners_m,
                np.asarray(found[0]).reshape(4, 2),
                self._info.color.matrix,
                self._distortion,
                flags=cv2.SOLVEPNP_IPPE_SQUARE,
            )
            if solved:
                pose = transform(np.asarray(cv2.Rodrigues(rotvec_rad)[0], dtype=np.float64), position_m.ravel())
            status = MarkerStatus.OK if pose is not None else MarkerStatus.BAD_FIT
        elif found:
            status = MarkerStatus.AMBIGUOUS
        return MarkerObservation(
            camera=self._camera,
            marker=self._marker,
            seq=frame.seq,
            t_capture_ns=frame.t_capture_ns,
            t_arrival_ns=frame.t_arrival_ns,
            status=status,
            camera_from_marker=pose,
            disks_used=0,
            depth_used=False,
        )

    def reset(self) -> None:
        """Do nothing: every frame stands alone."""
