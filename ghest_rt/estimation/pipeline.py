"""One station's whole path from frames and encoder samples to GH estimates, for the live service and off-line runs alike."""

from collections.abc import Mapping, Sequence

from ghest_drivers.samples import CameraInfo, EncoderSample, RgbdFrame
from ghest_rt.config.load import LoadedStation
from ghest_rt.config.station import StationConfig
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.arm_chain import CAMERAS
from ghest_rt.estimation.factory import make_estimator
from ghest_rt.messages.results import GhEstimate, MarkerObservation
from ghest_rt.vision.detector import MarkerDetector
from ghest_rt.vision.station import Method, StationVision


def lag_ns_of(config: StationConfig, method: str | None = None) -> int:
    """Return how long after an instant its estimate is asked for: the station's lag, none where the method forecasts.

    Args:
        config: The station file.
        method: Overrides its `estimator.method`.
    """
    return 0 if (method or config.estimator.method) == "fused" else round(config.estimator.lag_ms * 1e6)


class Pipeline:
    """A detector per camera and an estimator.

    `observe` may run in one thread per camera at a time; `add` and `estimate` belong to one thread together.

    Attributes:
        method: How markers are found and angles estimated ("aruco": OpenCV's markers and the refined estimator;
            "photometric": photometric detectors and the refined estimator;
            "fused": photometric detectors and the filter).
        rate_hz: How often estimates are wanted.
        lag_ns: How long after an instant its estimate is asked for.
    """

    def __init__(
        self,
        station: LoadedStation,
        camera_infos: Mapping[str, CameraInfo],
        encoder_joints: Sequence[str],
        method: Method | None = None,
        *,
        detectors: Mapping[str, MarkerDetector] | None = None,
    ) -> None:
        """Make detectors and estimator.

        Args:
            station: The station file and its URDF.
            camera_infos: Facts of each camera by name.
            encoder_joints: The joints that the encoder link sends, in its order.
            method: Overrides the station's `estimator.method`.
            detectors: Takes the place of the method's own detectors.

        Raises:
            BadInputError: A camera is missing, the method cannot do without depth, or the station does not fit the URDF or the
                encoder link.
        """
        config = station.config
        missing = [camera for camera in CAMERAS if camera not in camera_infos]
        if missing:
            raise BadInputError(f"{station.source}: no camera {' or '.join(missing)}; connect or record both cameras")
        self.method: Method = method or config.estimator.method
        self.rate_hz = config.rate_hz
        self.lag_ns = lag_ns_of(config, self.method)
        infos = {camera: camera_infos[camera] for camera in CAMERAS}
        self._vision = StationVision(config, infos, self.method, detectors)
        self._estimator = make_estimator(
            config,
            station.urdf_text,
            f"{config.exoskeleton.urdf} (of {station.source})",
            encoder_joints,
            method="refined" if self.method == "aruco" else self.method,
            frame_rate_hz={camera: camera_infos[camera].rate_hz for camera in CAMERAS},
        )

    @property
    def cameras(self) -> tuple[str, ...]:
        """The cameras whose frames are used."""
        return CAMERAS

    def observe(self, frame: RgbdFrame) -> MarkerObservation:
        """Find the camera's marker in a frame, steps 3.3.1; frames of one camera in their order."""
        return self._vision.observe(frame)

    def add(self, sample: MarkerObservation | EncoderSample) -> None:
        """Take what `observe` returned, or an encoder sample, in the order of arrival."""
        if isinstance(sample, MarkerObservation):
            self._estimator.add_marker(sample)
        else:
            self._estimator.add_encoder(sample)

    def estimate(self, t_ns: int) -> GhEstimate:
        """Return the GH joint at `t_ns`, or why there is none."""
        return self._estimator.estimate(t_ns)

    def counts(self) -> dict[str, int]:
        """Return how many samples were not used since the start, by reason."""
        return self._estimator.counts()
