"""Off-line runs: the grid, what had arrived by then, the end of the recording, and the same results however it is run."""

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from ghest_drivers.samples import CameraInfo, EncoderSample, Intrinsics, RgbdFrame
from ghest_rt.estimation.factory import make_estimator
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.geometry.so3 import angle_between_rad
from ghest_rt.messages.results import GhEstimate, MarkerObservation, Reason, Status
from ghest_rt.sync.grid import Grid

MS = 1_000_000
START = 2_000 * MS
PINHOLE = Intrinsics(4, 4, 4.0, 4.0, 1.5, 1.5)
INFO = {name: CameraInfo(name, "made up", "0", PINHOLE, PINHOLE, 1e-3, np.eye(4), 66.6) for name in ("r0", "r1")}
BLANK = np.zeros((4, 4, 3), dtype=np.uint8)


class ExactPipeline:
    """The real estimator behind detectors that know the truth."""

    def __init__(self, clinic: Any, lag_ms: float = 45.0, method: str = "refined", slow: str = "") -> None:
        self.clinic = clinic
        self.rate_hz = 66.6
        self.lag_ns = round(lag_ms * MS)
        self.cameras = ("r0", "r1")
        self.estimator = make_estimator(clinic.config, clinic.urdf, "u", ("yaw", "reach"), method=method)
        self.slow = slow

    def observe(self, frame: RgbdFrame) -> MarkerObservation:
        if frame.info.name == self.slow:
            time.sleep(0.001)
        latency_ms = (frame.t_arrival_ns - frame.t_capture_ns) / MS
        truth = self.clinic.moving(frame.t_capture_ns)
        return self.clinic.observation(frame.info.name, truth, frame.t_capture_ns, latency_ms=latency_ms)

    def add(self, sample: MarkerObservation | EncoderSample) -> None:
        if isinstance(sample, MarkerObservation):
            self.estimator.add_marker(sample)
        else:
            self.estimator.add_encoder(sample)

    def estimate(self, t_ns: int) -> GhEstimate:
        return self.estimator.estimate(t_ns)


def frame(camera: str, t_ns: int, latency_ns: int) -> RgbdFrame:
    return RgbdFrame(INFO[camera], 0, BLANK, None, t_ns, t_ns + latency_ns, t_ns, t_ns)


def recording(clinic: Any, *, offset_ms: float = 0.0, latency_ms: float = 0.0, count: int = 60, skip: Any = ()) -> list[Any]:
    """Return events in the order of arrival; r0 on the grid, r1 `offset_ms` later, encoders every 15.6 ms."""
    grid = Grid(START, 66.6)
    latency_ns = round(latency_ms * MS)
    events: list[Any] = []
    for k in range(count):
        for camera, offset_ns in (("r0", 0), ("r1", round(offset_ms * MS))):
            if (camera, k) not in skip:
                events.append(frame(camera, grid.at(k) + offset_ns, latency_ns))
    t_ns = START - 10 * MS
    while t_ns < grid.at(count) + 20 * MS:
        events.append(clinic.encoder(clinic.moving(t_ns), t_ns))
        t_ns += 15_600_000
    return sorted(events, key=lambda event: event.t_arrival_ns)


def run(clinic: Any, events: Any, *, threads: bool = False, **pipeline: Any) -> list[GhEstimate]:
    return list(estimate_events(events, ExactPipeline(clinic, **pipeline), threads=threads))


def test_simultaneous_frames_on_the_grid_are_all_estimated_exactly(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    for method, tolerance in (("refined", 3e-4), ("paper", 3e-2)):
        found = run(clinic, recording(clinic), method=method)
        assert [each.t_sample_ns for each in found] == [Grid(START, 66.6).at(k) for k in range(60)]
        assert {each.status for each in found} == {Status.VALID}
        for each in found:
            assert angle_between_rad(each.gh_from_arm, clinic.moving(each.t_sample_ns).gh_from_arm) < tolerance


def test_the_grid_starts_when_both_cameras_have_been_seen(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    late = recording(clinic, offset_ms=6.0, skip={("r1", k) for k in range(10)})
    found = run(clinic, late)
    assert found[0].t_sample_ns == Grid(START, 66.6).at(10) + 6 * MS
    assert found[0].status is Status.VALID
    one_camera = recording(clinic, skip={("r1", k) for k in range(60)})
    assert run(clinic, one_camera) == []


def test_asynchronous_cameras_are_interpolated(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    found = run(clinic, recording(clinic, offset_ms=6.0, latency_ms=22.0))
    for each in found[:-1]:
        assert each.status is Status.VALID
        assert angle_between_rad(each.gh_from_arm, clinic.moving(each.t_sample_ns).gh_from_arm) < 3e-4


def test_what_arrives_after_the_lag_is_too_late_as_it_is_live(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    events = recording(clinic, latency_ms=60.0)
    in_time = run(clinic, events, lag_ms=80.0)
    late = run(clinic, events, lag_ms=45.0)
    assert {each.status for each in in_time} == {Status.VALID}
    assert {each.reason for each in late[5:50]} == {Reason.R0_NO_FRAMES}
    assert [each.t_sample_ns for each in late] == [each.t_sample_ns for each in in_time]


def test_what_the_recording_ends_too_early_for_is_said_so(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    events = recording(clinic, offset_ms=6.0)
    last_encoder = START + 60 * 15 * MS - 40 * MS
    cut = [event for event in events if isinstance(event, RgbdFrame) or event.t_capture_ns < last_encoder]
    found = run(clinic, cut)
    ended = [each for each in found if each.reason is Reason.END_OF_RECORDING]
    assert 0 < len(ended) < 6
    assert found[-len(ended) :] == ended
    assert {each.status for each in ended} == {Status.LOST}


def test_cameras_that_end_one_after_the_other_end_with_the_recording(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    found = run(clinic, recording(clinic, offset_ms=20.0, skip={("r0", 59)}))
    assert {each.reason for each in found[:-3]} == {Reason.NONE}
    assert found[-1].reason is Reason.END_OF_RECORDING


def test_a_camera_that_dies_is_missed_to_the_end(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    found = run(clinic, recording(clinic, skip={("r1", k) for k in range(30, 60)}))
    assert len(found) == 60
    assert [each.reason for each in found[31:50]] == [Reason.R1_NO_FRAMES] * 19


@pytest.mark.parametrize("slow", ["", "r0", "r1"])
def test_threads_change_nothing(make_clinic: Callable[..., Any], slow: str) -> None:
    clinic = make_clinic(1)
    events = recording(clinic, offset_ms=4.0, latency_ms=20.0)
    one, two = run(clinic, events), run(clinic, events, threads=True, slow=slow)
    assert len(one) == len(two)
    for a, b in zip(one, two, strict=True):
        assert (a.t_sample_ns, a.status, a.reason, a.newest_ns) == (b.t_sample_ns, b.status, b.reason, b.newest_ns)
        np.testing.assert_array_equal(a.m0_from_arm, b.m0_from_arm)


def test_estimates_come_while_the_recording_is_read_and_reading_stays_little_ahead(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    read = 0

    def counted() -> Iterator[Any]:
        nonlocal read
        for event in recording(clinic, count=400):
            read += 1
            yield event

    estimates = estimate_events(counted(), ExactPipeline(clinic))
    for _ in range(10):
        next(estimates)
    assert read < 100
    estimates.close()


def test_other_rates_and_other_events(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    events = recording(clinic)
    found = list(estimate_events([object(), *events, object()], ExactPipeline(clinic), rate_hz=200.0))
    assert found[1].t_sample_ns - found[0].t_sample_ns == 5 * MS
    assert {each.status for each in found} == {Status.VALID}


def test_a_jump_of_the_clock_does_not_make_a_million_rows(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    year_ns = 365 * 24 * 3600 * 10**9
    before = recording(clinic)
    after = [frame(each.info.name, each.t_capture_ns + year_ns, 0) for each in before if isinstance(each, RgbdFrame)]
    found = run(clinic, before + after)
    assert 700 < len(found) < 1500
    assert found[-1].t_sample_ns > year_ns


def test_a_detector_that_fails_fails_the_run(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(1)
    pipeline = ExactPipeline(clinic)

    def broken(frame: RgbdFrame) -> MarkerObservation:
        raise ValueError("image of the wrong size")

    pipeline.observe = broken  # type: ignore[method-assign]
    with pytest.raises(ValueError, match="wrong size"):
        list(estimate_events(recording(clinic), pipeline))


@pytest.mark.parametrize(("outlast_ms", "extra"), [(200, 0), (600, 36)])
def test_encoders_that_outlast_the_frames_a_little_make_no_instants_of_their_own(
    make_clinic: Callable[..., Any], outlast_ms: int, extra: int
) -> None:
    clinic = make_clinic(1)
    events = recording(clinic)
    t_ns = events[-1].t_capture_ns
    end_ns = Grid(START, 66.6).at(59) + (outlast_ms + 45) * MS
    while t_ns < end_ns:
        t_ns += 15_600_000
        events.append(clinic.encoder(clinic.moving(t_ns), t_ns))
    found = run(clinic, events)
    assert [each.status for each in found[:60]] == [Status.VALID] * 60
    assert abs(len(found) - 60 - extra) <= 4
    assert {each.status for each in found[60:]} <= {Status.LOST}
    assert bool(found[60:]) == bool(extra)
