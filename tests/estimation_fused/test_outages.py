"""Blind cameras, silent encoders, wrong poses: bridged as long as that is honest, told when not."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from ghest_rt.estimation.fused.estimator import FusedEstimator
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import angle_between_rad, exp_so3
from ghest_rt.messages.results import MarkerObservation, MarkerStatus, Reason, Status
from tests.estimation_fused.stand import Blind, Judged, Trial, estimator_for, rms_deg, run, slipping, spoilt

FROM_S, TO_S = 2.5, 3.0


def during(judged: list[Judged], from_s: float, to_s: float) -> list[Judged]:
    return [j for j in judged if from_s <= j.t_s < to_s]


@pytest.mark.parametrize("frames", [True, False])
def test_half_a_second_without_m1_is_bridged_by_the_encoders(frames: bool) -> None:
    judged = run(Trial(duration_s=4.0, blind=(Blind("m1", FROM_S, TO_S, frames),)))
    bridged = during(judged, FROM_S + 0.1, TO_S)
    assert all((j.estimate.status, j.estimate.reason) == (Status.DEGRADED, Reason.BRIDGED) for j in bridged)
    assert max(j.error_deg for j in bridged) < 1.5
    assert bridged[-1].sigma_deg > 3.0 * judged[int((FROM_S - 0.1) * 66.6)].sigma_deg
    assert max(j.error_deg / j.sigma_deg for j in bridged) < 2.5
    assert judged[-1].estimate.status is Status.VALID


def test_half_a_second_without_m0_is_bridged_within_the_stated_uncertainty() -> None:
    judged = run(Trial(duration_s=4.0, blind=(Blind("m0", FROM_S, TO_S),)))
    bridged = during(judged, FROM_S + 0.1, TO_S)
    assert all(j.estimate.reason is Reason.BRIDGED for j in bridged)
    assert max(j.error_deg / j.sigma_deg for j in bridged) < 2.5


def test_recovery_does_not_jump_by_more_than_was_stated() -> None:
    judged = run(Trial(duration_s=4.0, blind=(Blind("m1", FROM_S, TO_S),)))
    for before, after in itertools.pairwise(judged):
        if before.t_s > 1.0:
            assert before.estimate.gh_from_arm is not None
            assert after.estimate.gh_from_arm is not None
            step = np.degrees(angle_between_rad(after.estimate.gh_from_arm, before.estimate.gh_from_arm))
            assert step < 2.5 + 3.0 * before.sigma_deg  # the movement itself makes up to 2 deg between two instants


@pytest.mark.parametrize(
    ("frames", "reason"), [(True, Reason.M0_NOT_SEEN), (False, Reason.R0_NO_FRAMES)], ids=["not seen", "no frames"]
)
def test_both_blind_is_lost_when_the_limit_is_reached_and_not_before(frames: bool, reason: Reason) -> None:
    blind = (Blind("m0", FROM_S, 9.0, frames), Blind("m1", FROM_S, 9.0, frames))
    judged = run(Trial(duration_s=5.0, blind=blind, estimator={"sigma_limit_deg": 2.0}))
    lost = [j for j in judged if j.t_s > FROM_S and j.estimate.status is Status.LOST]
    kept = [j for j in judged if FROM_S + 0.1 < j.t_s < lost[0].t_s]
    largest = [float(np.degrees(np.sqrt(np.linalg.eigvalsh(j.estimate.covariance)[-1]))) for j in kept]
    assert max(largest) <= 2.0
    assert largest[-1] > 1.8
    assert all(j.estimate.reason is reason and j.error_rad is None for j in lost)
    assert lost[-1].t_s == judged[-1].t_s


def test_nothing_is_bridged_for_ever() -> None:
    blind = (Blind("m0", 1.0, 99.0), Blind("m1", 1.0, 99.0))
    judged = run(Trial(duration_s=5.0, blind=blind, estimator={"sigma_limit_deg": 170.0}))
    assert judged[-1].estimate.status is Status.LOST


def test_after_a_long_outage_of_everything_it_is_as_good_as_before() -> None:
    blind = (Blind("m0", 1.0, 5.0, frames=False), Blind("m1", 1.0, 5.0, frames=False))
    judged = run(Trial(duration_s=6.5, blind=blind))
    assert judged[int(4.8 * 66.6)].estimate.status is Status.LOST
    assert judged[-1].estimate.status is Status.VALID
    assert rms_deg(judged, 5.2) < 0.25


@pytest.mark.parametrize("marker", ["m0", "m1"])
def test_a_single_wrong_pose_is_left_aside_and_counted(marker: str) -> None:
    """The mirror solution of a plane seen from the front: the plate tilted to the other side."""
    tilted = transform(exp_so3(np.array([0.5, 0.0, 0.0])), np.zeros(3))
    trial = Trial(duration_s=3.0, spoil=spoilt(marker, (90,), lambda T: T @ tilted))
    estimator = estimator_for(trial)
    judged = run(trial, estimator)
    assert estimator.counts() == {f"{marker}_outlier": 1}
    assert rms_deg(judged, 1.3, 2.0) < 0.25


def test_a_marker_seen_where_it_cannot_be_is_not_seen() -> None:
    """Frames come, with poses that the gate refuses: that is not told as missing frames. The limit lets nothing be bridged."""
    one, other = (transform(exp_so3(np.array(turn)), np.zeros(3)) for turn in ([0.5, 0.0, 0.0], [0.0, -0.5, 0.0]))
    even, odd = spoilt("m1", range(60, 67, 2), lambda T: T @ one), spoilt("m1", range(61, 67, 2), lambda T: T @ other)
    trial = Trial(duration_s=1.25, spoil=lambda observation: even(odd(observation)), estimator={"sigma_limit_deg": 0.05})
    estimator = estimator_for(trial)
    lost = [j for j in during(run(trial, estimator), 1.0, 2.0) if j.estimate.status is Status.LOST]
    assert estimator.counts() == {"m1_outlier": 7}
    assert lost
    assert {j.estimate.reason for j in lost} == {Reason.M1_NOT_SEEN}


@pytest.mark.parametrize(("slip_deg", "kept"), [(0.0, True), (6.0, False)], ids=["no slip", "slip"])
def test_what_is_unknown_of_a_slip_alone_ends_the_bridging(slip_deg: float, kept: bool) -> None:
    """A cuff that has slipped about the arm leaves a degree unknown: above the limit, although the filter itself is certain."""
    blind = (Blind("m1", 3.1, 9.0),)
    spoil = slipping(slip_deg, 2.1, 2.4)
    judged = run(Trial(duration_s=3.3, forearm=True, spoil=spoil, blind=blind, estimator={"sigma_limit_deg": 0.6}))
    last = judged[-1].estimate
    assert judged[int(3.0 * 66.6)].estimate.status is not Status.LOST
    assert (last.status, last.reason) == ((Status.DEGRADED, Reason.BRIDGED) if kept else (Status.LOST, Reason.M1_NOT_SEEN))


def test_refused_poses_are_no_evidence_of_the_elbow_or_the_forearm() -> None:
    """Every other frame of m1 is wrong for half a second: what is known of the elbow is as if they had not shown the marker."""
    wrong = range(60, 90, 2)
    tilted = transform(exp_so3(np.array([0.5, 0.0, 0.0])), np.zeros(3))

    def hidden(observation: MarkerObservation) -> MarkerObservation:
        if observation.marker == "m0" or observation.seq not in wrong:
            return observation
        return replace(observation, status=MarkerStatus.NOT_FOUND, camera_from_marker=None)

    found = []
    for spoil in (hidden, spoilt("m1", wrong, lambda T: T @ tilted)):
        trial = Trial(duration_s=1.6, forearm=True, spoil=spoil)
        estimator = estimator_for(trial)
        assert isinstance(estimator, FusedEstimator)
        run(trial, estimator)
        found.append((estimator, np.concatenate((estimator._witness._elbow.recent, estimator._witness._axial._settled.recent))))
    assert found[0][0].counts() == {}
    assert found[1][0].counts() == {"m1_outlier": len(wrong)}
    assert np.allclose(found[0][1], found[1][1], atol=1e-6)


def test_weaker_poses_degrade_the_status() -> None:
    def color_only(observation: MarkerObservation) -> MarkerObservation:
        return replace(observation, status=MarkerStatus.COLOR_ONLY, depth_used=False)

    judged = run(Trial(duration_s=1.0, spoil=color_only))
    assert (judged[-1].estimate.status, judged[-1].estimate.reason) == (Status.DEGRADED, Reason.COLOR_ONLY)
    three = run(Trial(duration_s=1.0, spoil=lambda observation: replace(observation, disks_used=3)))
    assert three[-1].estimate.reason is Reason.FEWER_DISKS
    vague = run(Trial(duration_s=1.0, rotation_deg=30.0, position_mm=30.0))
    assert vague[-1].estimate.status is not Status.VALID


def test_before_both_markers_were_seen_it_is_starting_then_says_which_is_missing() -> None:
    judged = run(Trial(duration_s=3.0, blind=(Blind("m1", 0.0, 9.0, frames=False),)))
    assert (judged[5].estimate.status, judged[5].estimate.reason) == (Status.LOST, Reason.STARTING)
    assert (judged[-1].estimate.status, judged[-1].estimate.reason) == (Status.LOST, Reason.R1_NO_FRAMES)


def test_without_encoders_there_is_no_estimate() -> None:
    trial = Trial(duration_s=1.0)
    estimator = estimator_for(trial)
    judged = run(trial, estimator)
    t_ns = judged[-1].estimate.t_sample_ns
    assert judged[-1].estimate.status is Status.VALID
    silent = estimator.estimate(t_ns + 300_000_000)
    assert (silent.status, silent.reason, silent.gh_from_arm) == (Status.LOST, Reason.ENCODERS_SILENT, None)
