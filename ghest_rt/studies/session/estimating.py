"""Estimates of an observed session, by the same off-line path as a recording's, and what the estimator is told wrongly."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ghest_drivers.samples import CameraInfo, EncoderSample, RgbdFrame
from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3
from ghest_rt.messages.results import GhEstimate, MarkerObservation
from ghest_rt.studies.observing.observed import Observed
from ghest_rt.studies.observing.scenario import MountError
from ghest_rt.vision.station import Method

_NO_COLOR = np.zeros((0, 0, 3), dtype=np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class _SeenBefore:
    """A detector that tells what was found in a frame when it was rendered."""

    observations: dict[int, MarkerObservation]

    def detect(self, frame: RgbdFrame) -> MarkerObservation:
        return self.observations[frame.seq]

    def reset(self) -> None:
        """It remembers nothing of earlier frames."""


def estimate_session(
    session: Observed,
    method: Method,
    *,
    mount_errors: Mapping[str, MountError] | None = None,
    encoder_bias_rad: Mapping[str, float] | None = None,
) -> list[GhEstimate]:
    """Return the estimates on the grid, in the order and with the delays of a recording of this session.

    Args:
        session: What was observed.
        method: How angles are estimated.
        mount_errors: By camera, how its calibrated pose is wrong.
        encoder_bias_rad: By joint, what the encoder says too much.

    Raises:
        BadInputError: A bias is given for a joint without an encoder, or a mount error for a camera that is not there.
    """
    station = with_mount_errors(session.station, mount_errors or {})
    detectors = {
        camera: _SeenBefore({found.seq: found for found in session.markers[method, camera]}) for camera in session.camera_infos
    }
    pipeline = Pipeline(station, session.camera_infos, session.joints, method, detectors=detectors)
    bias = _bias(session.joints, encoder_bias_rad or {})
    rows = [(row.t_arrival_ns, "encoders", row.seq, _biased(row, bias)) for row in session.encoders]
    frames = [
        (found.t_arrival_ns, camera, found.seq, _placeholder(session.camera_infos[camera], found))
        for camera in session.camera_infos
        for found in session.markers[method, camera]
    ]
    ordered = sorted([*rows, *frames], key=lambda event: event[:3])
    return list(estimate_events((event[3] for event in ordered), pipeline, threads=False))


def with_mount_errors(station: LoadedStation, errors: Mapping[str, MountError]) -> LoadedStation:
    """Return the station with camera mounts calibrated wrongly.

    Raises:
        BadInputError: It has no such camera.
    """
    if not errors:
        return station
    calibration = station.config.calibration
    unknown = sorted(set(errors) - set(calibration.link_from_camera))
    if unknown:
        raise BadInputError(f"{station.source}: no camera {', '.join(unknown)} whose mount could be calibrated wrongly")
    mounts = dict(calibration.link_from_camera)
    for camera, error in errors.items():
        wrong = calibration.link_from_camera_array(camera) @ transform(
            exp_so3(np.array(error.rotation_rad)), error.translation_m
        )
        first, second, third, fourth = (_row(row) for row in wrong.tolist())
        mounts[camera] = (first, second, third, fourth)
    changed = calibration.model_copy(update={"link_from_camera": mounts})
    return replace(station, config=station.config.model_copy(update={"calibration": changed}))


def _row(values: list[float]) -> tuple[float, float, float, float]:
    a, b, c, d = values
    return a, b, c, d


def _bias(joints: tuple[str, ...], bias_rad: Mapping[str, float]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    unknown = sorted(set(bias_rad) - set(joints))
    if unknown:
        raise BadInputError(f"encoder bias of {', '.join(unknown)}: the joints with encoders are {', '.join(joints)}")
    return np.array([bias_rad.get(joint, 0.0) for joint in joints])


def _biased(row: EncoderSample, bias: np.ndarray[tuple[int], np.dtype[np.float64]]) -> EncoderSample:
    return replace(row, angles_rad=row.angles_rad + bias)


def _placeholder(info: CameraInfo, found: MarkerObservation) -> RgbdFrame:
    """Return a frame without images, for its place in the order of arrival."""
    return RgbdFrame(
        info, found.seq, _NO_COLOR, None, found.t_capture_ns, found.t_arrival_ns, found.t_capture_ns, found.t_capture_ns
    )
