"""Method `paper`: the marker pose by eq. (1)-(5) to the letter, frame by frame, without memory."""

import numpy as np

from ghest_drivers.samples import CameraInfo, RgbdFrame
from ghest_rt.config.station import Marker
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import MarkerObservation, MarkerStatus
from ghest_rt.vision.checks import check_frame
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.paper_disks import blob_center, segment_colors
from ghest_rt.vision.paper_frame import marker_frame
from ghest_rt.vision.paper_points import cloud_indices_eq2, depth_pixel_eq1, point_cloud, point_eq3
from ghest_rt.vision.registration import DepthRegistration, is_registered, ray_grid

# Half the least distance, in its widest channel, between any two disk colours of the shipped stations.
COLOR_TOLERANCE = 50


class PaperDetector:
    """The paper's estimation of the marker pose, 3.3.1.

    It needs depth in the colour camera's coordinate system; a depth camera of its own is registered first. All four disks
    must be seen, with depth at their centres.
    """

    def __init__(self, camera_name: str, marker_name: str, marker: Marker, info: CameraInfo) -> None:
        self._camera = camera_name
        self._marker = marker_name
        self._info = info
        self._disk_rgb = MarkerLayout.of(marker).disk_rgb
        registered = is_registered(info)
        self._register = None if registered else DepthRegistration(info)
        self._rays = ray_grid(info.depth if registered else info.color)

    def detect(self, frame: RgbdFrame) -> MarkerObservation:
        """Return the marker's pose by eq. (4) and (5).

        Raises:
            BadInputError: The images are not those of the camera that the detector was made for.
        """
        check_frame(frame, self._info)
        centers = [blob_center(mask) for mask in segment_colors(frame.color_rgb, self._disk_rgb, COLOR_TOLERANCE)]
        seen = [center for center in centers if center is not None]
        if not seen:
            return self._observation(frame, MarkerStatus.NOT_FOUND, 0, None)
        points_m = self._points(frame, seen)
        if len(points_m) < len(centers):
            return self._observation(frame, MarkerStatus.TOO_FEW_DISKS, len(points_m), None)
        pose = marker_frame(np.array(points_m))
        return self._observation(frame, MarkerStatus.BAD_FIT if pose is None else MarkerStatus.OK, len(points_m), pose)

    def reset(self) -> None:
        """Do nothing: every frame stands alone."""

    def _points(self, frame: RgbdFrame, centers: list[tuple[int, int]]) -> list[Array]:
        """Eq. (1)-(3) for the disk centres of the colour image; points without depth are left out."""
        if frame.depth_counts is None:
            return []
        depth = frame.depth_counts if self._register is None else self._register(frame.depth_counts)
        cloud = point_cloud(depth, self._info.depth_unit_m, self._rays)
        N, L = depth.shape
        B, A = frame.color_rgb.shape[:2]
        pixels = [depth_pixel_eq1(u, v, (A, B), (L, N)) for u, v in centers]
        points_m = [point_eq3(cloud, cloud_indices_eq2(u, v, L)) for u, v in pixels]
        return [point_m for point_m in points_m if point_m is not None]

    def _observation(self, frame: RgbdFrame, status: MarkerStatus, disks: int, pose: Array | None) -> MarkerObservation:
        return MarkerObservation(
            camera=self._camera,
            marker=self._marker,
            seq=frame.seq,
            t_capture_ns=frame.t_capture_ns,
            t_arrival_ns=frame.t_arrival_ns,
            status=status,
            camera_from_marker=pose,
            disks_used=disks,
            depth_used=pose is not None,
        )
