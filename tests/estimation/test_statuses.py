"""What an estimate says when the inputs do not cover its instant, or only just; never an old angle as if it were new."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from ghest_drivers.samples import EncoderSample
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.factory import make_estimator
from ghest_rt.estimation.interface import GhEstimator
from ghest_rt.geometry.so3 import angle_between_rad
from ghest_rt.messages.results import GhEstimate, MarkerStatus, Reason, Status

MS = 1_000_000
PERIOD = 15 * MS
START = 1_000 * MS
FrameFilter = Callable[[str, int], dict[str, Any] | None]


class Scene:
    """Feeds an estimator with a movement; single inputs can be cut off, thinned out or spoilt."""

    def __init__(self, make_clinic: Callable[..., Any], method: str = "refined", **estimator: Any) -> None:
        self.clinic = make_clinic(0, **estimator)
        self.estimator: GhEstimator = make_estimator(
            self.clinic.config, self.clinic.urdf, "u", ("yaw", "reach"), method=method, frame_rate_hz={"r0": 66.6, "r1": 66.6}
        )

    def feed(
        self,
        frames: FrameFilter = lambda camera, k: {},
        encoders: Callable[[int], bool] = lambda k: True,
        spoil: Callable[[EncoderSample], EncoderSample] = lambda sample: sample,
        count: int = 40,
    ) -> "Scene":
        """Feed `count` frame periods from START on; `frames` gives fields of the observation, or None for a lost frame."""
        for k in range(count):
            t_frame = START + k * PERIOD
            t_encoder = t_frame - 4 * MS
            if encoders(k):
                self.estimator.add_encoder(spoil(self.clinic.encoder(self.clinic.moving(t_encoder), t_encoder, seq=k)))
            for camera in ("r0", "r1"):
                fields = frames(camera, k)
                if fields is not None:
                    self.estimator.add_marker(self.clinic.observation(camera, self.clinic.moving(t_frame), t_frame, **fields))
        return self

    def at(self, periods: float) -> GhEstimate:
        return self.estimator.estimate(START + round(periods * PERIOD))

    def error_rad(self, estimate: GhEstimate) -> float:
        assert estimate.gh_from_arm is not None
        return angle_between_rad(estimate.gh_from_arm, self.clinic.moving(estimate.t_sample_ns).gh_from_arm)


def no_angles(estimate: GhEstimate, reason: Reason) -> bool:
    values = (estimate.gh_from_arm, estimate.m0_from_arm, estimate.e_from_m0, estimate.e_from_m1, estimate.covariance)
    return estimate.status is Status.LOST and estimate.reason is reason and all(value is None for value in values)


def test_between_frames_the_estimate_is_of_the_instant_asked_for(make_clinic: Callable[..., Any]) -> None:
    scene = Scene(make_clinic).feed()
    for periods in (5.0, 10.25, 17.5, 30.9):
        found = scene.at(periods)
        assert (found.status, found.reason) == (Status.VALID, Reason.NONE)
        assert scene.error_rad(found) < 2e-4
        assert found.covariance is not None
    held = scene.at(17.0).gh_from_arm
    assert scene.error_rad(scene.at(17.5)) < 0.05 * angle_between_rad(held, scene.at(17.5).gh_from_arm)


def test_the_refined_way_beats_the_papers_between_frames(make_clinic: Callable[..., Any]) -> None:
    refined, paper = (Scene(make_clinic, method).feed() for method in ("refined", "paper"))
    for periods in (10.5, 20.5, 30.5):
        assert refined.error_rad(refined.at(periods)) < 0.1 * paper.error_rad(paper.at(periods))


def test_it_says_how_new_what_it_used_is(make_clinic: Callable[..., Any]) -> None:
    found = Scene(make_clinic).feed().at(10.5)
    assert found.newest_ns == {"r0": START + 11 * PERIOD, "r1": START + 11 * PERIOD, "encoders": START + 12 * PERIOD - 4 * MS}
    lost = Scene(make_clinic).feed(frames=lambda camera, k: {} if camera == "r0" else None).at(10.5)
    assert "r1" not in lost.newest_ns
    assert lost.newest_ns["r0"] == START + 39 * PERIOD


def test_nothing_is_presented_before_its_time_or_after(make_clinic: Callable[..., Any]) -> None:
    scene = Scene(make_clinic).feed()
    assert no_angles(scene.at(-1.0), Reason.STARTING)
    assert scene.at(37.5).status is Status.VALID
    assert scene.at(39.5).status is Status.LOST
    assert no_angles(scene.at(300.0), Reason.ENCODERS_SILENT)


@pytest.mark.parametrize("method", ["paper", "refined"])
def test_without_any_input_it_is_starting(make_clinic: Callable[..., Any], method: str) -> None:
    assert no_angles(Scene(make_clinic, method).at(0.0), Reason.STARTING)


@pytest.mark.parametrize("method", ["paper", "refined"])
@pytest.mark.parametrize(
    ("inputs", "periods", "reason"),
    [
        ((lambda camera, k: None if camera == "r0" else {}, lambda k: True), 20.5, Reason.STARTING),
        ((lambda camera, k: None if camera == "r0" else {}, lambda k: True), 190.5, Reason.R0_NO_FRAMES),
        ((lambda camera, k: None if camera == "r1" else {}, lambda k: True), 190.5, Reason.R1_NO_FRAMES),
        ((lambda camera, k: {}, lambda k: False), 20.5, Reason.STARTING),
        ((lambda camera, k: {}, lambda k: False), 190.5, Reason.ENCODERS_SILENT),
        ((lambda camera, k: {}, lambda k: k < 100), 190.5, Reason.ENCODERS_SILENT),
        ((lambda camera, k: None if camera == "r0" and k > 100 else {}, lambda k: True), 120.5, Reason.R0_NO_FRAMES),
        ((lambda camera, k: None if camera == "r1" and k > 100 else {}, lambda k: True), 120.5, Reason.R1_NO_FRAMES),
        ((lambda camera, k: {"seen": camera != "r0"}, lambda k: True), 20.5, Reason.M0_NOT_SEEN),
        ((lambda camera, k: {"seen": camera != "r1"}, lambda k: True), 20.5, Reason.M1_NOT_SEEN),
        ((lambda camera, k: {"seen": camera != "r1" or k < 100}, lambda k: True), 120.5, Reason.M1_NOT_SEEN),
        ((lambda camera, k: {"seen": k < 90} if camera == "r1" or k < 95 else None, lambda k: True), 95.2, Reason.M0_NOT_SEEN),
    ],
)
def test_a_missing_input_is_named(
    make_clinic: Callable[..., Any],
    method: str,
    inputs: tuple[FrameFilter, Callable[[int], bool]],
    periods: float,
    reason: Reason,
) -> None:
    assert no_angles(Scene(make_clinic, method).feed(*inputs, count=200).at(periods), reason)


def test_nonsense_from_the_encoders_is_told_apart_from_silence(make_clinic: Callable[..., Any]) -> None:
    def spoil(sample: EncoderSample) -> EncoderSample:
        return EncoderSample(sample.seq, sample.angles_rad + 40.0, sample.t_device_ns, sample.t_arrival_ns, sample.t_capture_ns)

    scene = Scene(make_clinic).feed(spoil=lambda sample: spoil(sample) if sample.seq > 20 else sample)
    assert scene.at(15.5).status is Status.VALID
    assert no_angles(scene.at(30.5), Reason.ENCODERS_IMPLAUSIBLE)
    assert scene.estimator.counts()["encoders_beyond_limits"] == 19


def test_a_lost_frame_is_bridged_and_flagged_but_a_long_gap_is_not(make_clinic: Callable[..., Any]) -> None:
    scene = Scene(make_clinic).feed(lambda camera, k: None if camera == "r1" and (k == 10 or 20 < k < 29) else {})
    bridged = scene.at(10.0)
    assert (bridged.status, bridged.reason) == (Status.DEGRADED, Reason.BRIDGED)
    assert scene.error_rad(bridged) < 1e-3
    assert scene.at(11.0).status is Status.VALID
    assert no_angles(scene.at(24.5), Reason.R1_NO_FRAMES)


def test_a_frame_without_the_marker_is_bridged_like_a_lost_one(make_clinic: Callable[..., Any]) -> None:
    scene = Scene(make_clinic).feed(lambda camera, k: {"seen": camera != "r0" or not (k == 10 or 20 < k < 29)})
    assert scene.at(10.0).reason is Reason.BRIDGED
    assert no_angles(scene.at(24.5), Reason.M0_NOT_SEEN)


def test_the_papers_way_holds_nothing_over_a_lost_frame(make_clinic: Callable[..., Any]) -> None:
    scene = Scene(make_clinic, "paper").feed(lambda camera, k: None if camera == "r0" and k == 10 else {})
    assert scene.at(9.9).status is Status.VALID
    assert no_angles(scene.at(10.9), Reason.R0_NO_FRAMES)
    unseen = Scene(make_clinic, "paper").feed(lambda camera, k: {"seen": camera != "r1" or k != 10})
    assert no_angles(unseen.at(10.0), Reason.M1_NOT_SEEN)
    assert unseen.at(11.0).status is Status.VALID


def test_a_silence_of_the_encoders_is_bridged_briefly(make_clinic: Callable[..., Any]) -> None:
    scene = Scene(make_clinic).feed(encoders=lambda k: k not in (10, 11, 12) and not 20 < k < 29)
    assert scene.at(11.0).reason is Reason.BRIDGED
    assert scene.at(15.0).status is Status.VALID
    assert no_angles(scene.at(25.0), Reason.ENCODERS_SILENT)
    assert scene.estimator.counts()["frames_without_encoders"] == 9


@pytest.mark.parametrize("method", ["paper", "refined"])
@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"status": MarkerStatus.COLOR_ONLY, "depth_used": False}, Reason.COLOR_ONLY),
        ({"disks_used": 3}, Reason.FEWER_DISKS),
        ({"covariance": np.eye(6)}, Reason.UNCERTAIN),
    ],
)
def test_angles_from_less_information_are_degraded(
    make_clinic: Callable[..., Any], method: str, fields: dict[str, Any], reason: Reason
) -> None:
    for poor in ("r0", "r1"):
        found = Scene(make_clinic, method).feed(lambda camera, k, poor=poor: fields if camera == poor else {}).at(10.0)
        assert (found.status, found.reason) == (Status.DEGRADED, reason)
        assert found.gh_from_arm is not None


def test_without_covariances_there_is_none_but_the_sample_is_valid(make_clinic: Callable[..., Any]) -> None:
    found = Scene(make_clinic).feed(lambda camera, k: {"covariance": None}).at(10.5)
    assert found.status is Status.VALID
    assert found.covariance is None


def test_frames_wait_for_the_encoders_and_late_or_doubled_ones_do_no_harm(make_clinic: Callable[..., Any]) -> None:
    orderly, messy = Scene(make_clinic).feed(), Scene(make_clinic)
    clinic = messy.clinic
    frames = [
        clinic.observation(camera, clinic.moving(START + k * PERIOD), START + k * PERIOD)
        for k in range(40)
        for camera in ("r0", "r1")
    ]
    samples = [clinic.encoder(clinic.moving(t), t, seq=k) for k in range(40) for t in [START + k * PERIOD - 4 * MS]]
    messy.estimator.add_encoder(clinic.encoder(clinic.moving(START - 4 * MS - PERIOD), START - 4 * MS - PERIOD, seq=-1))
    for k in range(0, 40, 4):
        for frame in (*reversed(frames[2 * k : 2 * k + 8]), frames[2 * k]):
            messy.estimator.add_marker(frame)
        for sample in (samples[k + 1], samples[k], samples[k + 2], samples[k + 2], samples[k + 3]):
            messy.estimator.add_encoder(sample)
    for periods in (10.0, 10.5, 20.3, 33.8):
        assert messy.at(periods).status is Status.VALID
        assert messy.error_rad(messy.at(periods)) < orderly.error_rad(orderly.at(periods)) + 5e-5
    assert messy.estimator.counts() == {"encoders_duplicate": 10, "r0_duplicate": 10}


def test_a_frame_from_the_future_is_counted_and_not_used(make_clinic: Callable[..., Any]) -> None:
    scene = Scene(make_clinic).feed(lambda camera, k: {"latency_ms": -3_600_000.0} if k == 10 else {})
    assert scene.estimator.counts() == {"r0_from_the_future": 1, "r1_from_the_future": 1}
    assert scene.at(10.0).reason is Reason.BRIDGED


def test_nearest_pairing_takes_the_nearest_sample(make_clinic: Callable[..., Any]) -> None:
    near = Scene(make_clinic, encoder_pairing="nearest").feed().at(10.0)
    between = Scene(make_clinic).feed().at(10.0)
    scene = Scene(make_clinic)
    shift = angle_between_rad(near.e_from_m1[:3, :3], between.e_from_m1[:3, :3])
    joints = [scene.clinic.moving(START + 10 * PERIOD - ms * MS).joints_rad for ms in (4, 0)]
    moved = angle_between_rad(*(scene.clinic.e_from_camera("r1", q)[:3, :3] for q in joints))
    assert shift == pytest.approx(moved, rel=0.05)


@pytest.mark.parametrize("method", ["paper", "refined"])
def test_it_recovers_when_everything_comes_back(make_clinic: Callable[..., Any], method: str) -> None:
    scene = Scene(make_clinic, method).feed(
        lambda camera, k: None if 50 <= k < 100 else {}, lambda k: not 80 <= k < 150, count=200
    )
    assert scene.at(48.0).status is Status.VALID
    assert scene.at(75.0).status is Status.LOST
    assert scene.at(120.0).status is Status.LOST
    assert scene.at(180.0).status is Status.VALID


def test_an_hour_of_samples_stays_in_bounded_memory(make_clinic: Callable[..., Any]) -> None:
    """Frames without encoders, too, must not pile up."""
    scene = Scene(make_clinic).feed(encoders=lambda k: k < 3, count=3_000)
    assert len(scene.estimator._waiting) <= 32  # type: ignore[attr-defined]
    assert max(len(frames) for frames in scene.estimator._inputs.frames.values()) <= 512  # type: ignore[attr-defined]
    assert len(scene.estimator._tracks["r0"]) <= 512  # type: ignore[attr-defined]


def test_an_encoder_link_with_other_joints_is_refused(make_clinic: Callable[..., Any]) -> None:
    clinic = make_clinic(0)
    with pytest.raises(BadInputError, match=r"yaw, reach.*reach, yaw"):
        make_estimator(clinic.config, clinic.urdf, "u", ("reach", "yaw"))
