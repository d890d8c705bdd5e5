"""Where a marker was at an instant."""

from dataclasses import replace

import numpy as np
import pytest

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import angle_between_rad, rot_z
from ghest_rt.sync.miss import Miss
from ghest_rt.sync.pose_track import EXACT_NS, PoseSample, PoseTrack

MS = 1_000_000
PERIOD = 15 * MS
GAP = 100 * MS


def sample(t_ms: float, angle: float = 0.0, x: float = 0.0, variance: float | None = 1.0) -> PoseSample:
    t_ns = round(t_ms * MS)
    covariance = None if variance is None else variance * np.eye(6)
    return PoseSample(t_ns, transform(rot_z(angle), [x, 0.0, 0.0]), covariance, False, False, False, t_ns, t_ns + 1)


def track(*samples: PoseSample) -> PoseTrack:
    out = PoseTrack(PERIOD)
    for each in samples:
        assert out.add(each)
    return out


def at(t: PoseTrack, t_ms: float) -> PoseSample:
    found = t.at(round(t_ms * MS), GAP)
    assert not isinstance(found, Miss), found
    return found


@pytest.mark.parametrize("off_ns", [0, 1, -1, EXACT_NS, -EXACT_NS])
def test_an_exact_hit_is_the_observation_itself_even_at_either_end(off_ns: int) -> None:
    samples = [sample(0), sample(15, 0.1), sample(30, 0.2)]
    t = track(*samples)
    for each in samples:
        assert t.at(each.t_ns + off_ns, GAP) is each


def test_between_observations_rotation_and_position_move_at_constant_rate() -> None:
    pose = at(track(sample(0, 0.0, 0.0), sample(16, 0.8, 0.4)), 4)
    assert angle_between_rad(pose.e_from_marker[:3, :3], rot_z(0.2)) < 1e-12
    np.testing.assert_allclose(pose.e_from_marker[:3, 3], [0.1, 0.0, 0.0], atol=1e-15)
    assert pose.t_ns == 4 * MS
    assert (pose.newest_ns, pose.encoders_ns) == (16 * MS, 16 * MS + 1)


def test_nothing_is_extrapolated() -> None:
    assert PoseTrack(PERIOD).at(0, GAP) is Miss.EMPTY
    t = track(sample(0), sample(15), sample(200))
    assert t.at(-2 * EXACT_NS, GAP) is Miss.TOO_EARLY
    assert t.at(200 * MS + 2 * EXACT_NS, GAP) is Miss.NOT_YET
    assert t.at(100 * MS, GAP) is Miss.GAP


def test_a_missing_frame_is_bridged_and_said_so() -> None:
    t = track(sample(0), sample(15), sample(45), sample(60))
    assert not at(t, 7).bridged
    assert at(t, 30).bridged
    assert not at(t, 45).bridged
    assert not at(t, 50).bridged


def test_one_poorer_neighbour_makes_the_pose_between_poorer() -> None:
    good, poor = sample(0), replace(sample(15), color_only=True, fewer_disks=True)
    between = at(track(good, poor), 5)
    assert between.color_only
    assert between.fewer_disks


def test_covariance_is_the_weighted_mean_and_unknown_if_either_is() -> None:
    np.testing.assert_allclose(at(track(sample(0, variance=1.0), sample(10, variance=3.0)), 2.5).covariance, 1.5 * np.eye(6))
    assert at(track(sample(0, variance=None), sample(10)), 2.5).covariance is None


def test_frames_out_of_order_are_put_right_and_a_second_of_one_instant_is_refused() -> None:
    t = track(sample(0, 0.0), sample(30, 0.6), sample(15, 0.1))
    assert angle_between_rad(at(t, 20).e_from_marker[:3, :3], rot_z(0.1 + 0.5 / 3)) < 1e-12
    assert not t.add(sample(15, 0.9))
    assert angle_between_rad(at(t, 15).e_from_marker[:3, :3], rot_z(0.1)) < 1e-12


def test_memory_is_bounded_over_a_long_session() -> None:
    t = PoseTrack(PERIOD)
    largest = 0
    for k in range(5_000):
        t.add(sample(15 * k))
        largest = max(largest, len(t))
    assert largest <= 512
    assert not at(t, 15 * 4_990 + 3).bridged
