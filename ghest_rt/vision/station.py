"""The detectors of a station's cameras."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

from ghest_drivers.samples import CameraInfo, RgbdFrame
from ghest_rt.config.station import StationConfig
from ghest_rt.messages.results import MarkerObservation, MarkerStatus
from ghest_rt.vision.detector import MarkerDetector
from ghest_rt.vision.factory import make_detector

Method = Literal["paper", "refined", "photometric", "aruco", "fused"]


class StationVision:
    """A detector per camera; `observe` may run in one thread per camera at a time."""

    def __init__(
        self,
        config: StationConfig,
        camera_infos: Mapping[str, CameraInfo],
        method: Method,
        detectors: Mapping[str, MarkerDetector] | None = None,
    ) -> None:
        """Make the detectors.

        Args:
            config: The station file.
            camera_infos: Facts of each camera by name.
            method: How angles are estimated; "fused" finds markers as "photometric" does.
            detectors: Takes the place of the method's own detectors.

        Raises:
            BadInputError: The method cannot do without depth.
        """
        self._without_depth = frozenset(camera for camera in camera_infos if not config.cameras[camera].depth)
        self._detectors = (
            dict(detectors)
            if detectors is not None
            else {
                camera: make_detector(
                    "photometric" if method == "fused" else method,
                    camera,
                    config.cameras[camera].marker,
                    config.markers[config.cameras[camera].marker],
                    info,
                    color_only=camera in self._without_depth,
                )
                for camera, info in camera_infos.items()
            }
        )

    def observe(self, frame: RgbdFrame) -> MarkerObservation:
        """Find the camera's marker in a frame, steps 3.3.1; frames of one camera in their order.

        A pose from colour alone is no worse than normal where the station file leaves depth out.
        """
        seen = self._detectors[frame.info.name].detect(frame)
        if seen.status is MarkerStatus.COLOR_ONLY and seen.camera in self._without_depth:
            return replace(seen, status=MarkerStatus.OK)
        return seen
