"""The pipeline puts detectors and estimator together for one station."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.geometry.so3 import angle_between_rad
from ghest_rt.messages.results import MarkerObservation, Reason, Status

MS = 1_000_000
JOINTS = ("yaw", "reach")
PINHOLE = Intrinsics(128, 128, 154.5, 154.5, 63.5, 63.5)
INFOS = {name: CameraInfo(name, "made up", "0", PINHOLE, PINHOLE, 1e-4, np.eye(4), 30.0) for name in ("r0", "r1")}
BLACK = np.zeros((128, 128, 3), dtype=np.uint8)


class Oracle:
    """A detector that knows the truth."""

    def __init__(self, clinic: Any) -> None:
        self.clinic = clinic

    def detect(self, frame: RgbdFrame) -> MarkerObservation:
        return self.clinic.observation(frame.info.name, self.clinic.moving(frame.t_capture_ns), frame.t_capture_ns)

    def reset(self) -> None:
        raise NotImplementedError


def frames(period_ms: int, count: int) -> list[RgbdFrame]:
    return [
        RgbdFrame(INFOS[camera], k, BLACK, np.zeros((128, 128), np.uint16), t_ns, t_ns + MS, t_ns, t_ns)
        for k in range(count)
        for t_ns in [(1_000 + k * period_ms) * MS]
        for camera in ("r0", "r1")
    ]


def events(clinic: Any, period_ms: int = 33, count: int = 20) -> list[Any]:
    encoders = [clinic.encoder(clinic.moving(t_ms * MS), t_ms * MS) for t_ms in range(990, 1_020 + (count - 1) * period_ms, 10)]
    return sorted([*frames(period_ms, count), *encoders], key=lambda event: event.t_arrival_ns)


def test_frames_and_encoders_become_estimates(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(2, method="refined")
    oracle = Oracle(clinic)
    pipeline = Pipeline(clinic.station, INFOS, JOINTS, detectors={"r0": oracle, "r1": oracle})
    assert (pipeline.method, pipeline.rate_hz, pipeline.lag_ns) == ("refined", 66.6, 45 * MS)
    found = list(estimate_events(events(clinic), pipeline))
    assert len(found) > 35
    # The camera's own rate, not the publishing rate, tells what a normal gap between frames is.
    assert {each.reason for each in found} == {Reason.NONE}
    for each in found:
        assert angle_between_rad(each.gh_from_arm, clinic.moving(each.t_sample_ns).gh_from_arm) < 2e-3
    assert pipeline.counts() == {}


@pytest.mark.parametrize("method", ["paper", "refined", "aruco"])
def test_the_methods_own_detectors_see_nothing_in_black_images(make_clinic: Callable[..., Any], method: Any) -> None:
    clinic = make_clinic(2)
    pipeline = Pipeline(clinic.station, INFOS, JOINTS, method)
    found = list(estimate_events(events(clinic, count=8), pipeline))
    assert found
    assert {each.status for each in found} == {Status.LOST}
    assert {each.reason for each in found} <= {Reason.M0_NOT_SEEN, Reason.M1_NOT_SEEN}


def test_the_station_chooses_the_method_and_the_lag(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(2, method="paper", lag_ms=12.5)
    pipeline = Pipeline(clinic.station, INFOS, JOINTS)
    assert (pipeline.method, pipeline.lag_ns) == ("paper", 12_500_000)


def test_what_does_not_fit_is_refused_by_name(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(2)
    with pytest.raises(BadInputError, match="camera r1"):
        Pipeline(clinic.station, {"r0": INFOS["r0"]}, JOINTS)
    with pytest.raises(BadInputError, match="make the station file agree"):
        Pipeline(clinic.station, INFOS, ("yaw",))
