"""What the encoders said at an instant, through duplicates, repeats, reordering, gaps and nonsense."""

import numpy as np
import pytest

from ghest_drivers.samples import EncoderSample
from ghest_rt.sync.encoder_track import EncoderRejection, EncoderTrack
from ghest_rt.sync.miss import Miss

MS = 1_000_000
FREE = np.array([[-np.inf, np.inf], [-2.0, 2.0]])
GAP = 100 * MS


def sample(seq: int, t_ms: float, *angles: float, latency_ms: float = 1.0) -> EncoderSample:
    t_ns = round(t_ms * MS)
    return EncoderSample(seq, np.array(angles), t_ns, t_ns + round(latency_ms * MS), t_ns)


def track(*samples: EncoderSample) -> EncoderTrack:
    out = EncoderTrack(FREE)
    for each in samples:
        out.add(each)
    return out


def positions(state: object) -> np.ndarray:
    assert not isinstance(state, Miss), state
    return state.positions  # type: ignore[attr-defined]


def test_between_samples_the_angles_are_interpolated() -> None:
    t = track(sample(0, 0, 0.0, 1.0), sample(1, 16, 0.8, 0.0))
    state = t.at(4 * MS, GAP)
    np.testing.assert_allclose(positions(state), [0.2, 0.75])
    assert (state.newest_ns, state.gap_ns) == (16 * MS, 16 * MS)


def test_an_exact_hit_is_the_sample_itself() -> None:
    t = track(sample(0, 0, 0.1, 0.2), sample(1, 16, 0.3, 0.4))
    for t_ns, expected in ((0, [0.1, 0.2]), (16 * MS, [0.3, 0.4])):
        state = t.at(t_ns, GAP)
        np.testing.assert_array_equal(positions(state), expected)
        assert state.gap_ns == 0


def test_nothing_is_extrapolated() -> None:
    assert EncoderTrack(FREE).at(0, GAP) is Miss.EMPTY
    t = track(sample(0, 10, 0.0, 0.0), sample(1, 20, 0.0, 0.0), sample(2, 130, 0.0, 0.0))
    assert t.at(10 * MS - 1, GAP) is Miss.TOO_EARLY
    assert t.at(130 * MS + 1, GAP) is Miss.NOT_YET
    assert t.at(60 * MS, GAP) is Miss.GAP
    assert not isinstance(t.at(60 * MS, 110 * MS), Miss)


@pytest.mark.parametrize(
    ("second", "reason"),
    [
        (sample(5, 16, 0.5, 0.5), EncoderRejection.DUPLICATE),
        (sample(6, 16, 0.7, 0.5), EncoderRejection.DUPLICATE),
        (sample(5, 16.5, 0.7, 0.5), EncoderRejection.DUPLICATE),
        (sample(6, 17.9, 0.5, 0.5), EncoderRejection.REPEATED),
        (sample(6, -200, 0.5, 0.6), EncoderRejection.STEPPED_BACK),
        (sample(6, 3_600_000, 0.5, 0.6, latency_ms=-3_500_000), EncoderRejection.FROM_THE_FUTURE),
        (sample(6, 32, 0.5), EncoderRejection.WRONG_SIZE),
        (sample(6, 32, 0.5, 0.5, 0.5), EncoderRejection.WRONG_SIZE),
        (sample(6, 32, np.nan, 0.5), EncoderRejection.NOT_FINITE),
        (sample(6, 32, np.inf, 0.5), EncoderRejection.NOT_FINITE),
        (sample(6, 32, 0.5, 2.3), EncoderRejection.BEYOND_LIMITS),
        (sample(6, 32, 0.5, -2.3), EncoderRejection.BEYOND_LIMITS),
    ],
)
def test_what_cannot_be_used_is_counted_by_reason_and_changes_nothing(second: EncoderSample, reason: EncoderRejection) -> None:
    t = track(sample(4, 0, 0.4, 0.4), sample(5, 16, 0.5, 0.5))
    assert t.add(second) is reason
    assert t.last_rejection is reason
    assert dict(t.rejected) == {reason: 1}
    assert (len(t), t.newest_ns) == (2, 16 * MS)
    np.testing.assert_array_equal(positions(t.at(16 * MS, GAP)), [0.5, 0.5])


def test_fast_encoders_that_move_are_all_taken() -> None:
    t = track(*(sample(k, k, 0.001 * k, 0.0) for k in range(50)))
    assert len(t) == 50
    assert not t.rejected


def test_neighbours_in_the_wrong_order_are_put_right() -> None:
    right = track(sample(0, 0, 0.0, 0.0), sample(1, 16, 0.5, 0.0), sample(2, 32, 0.6, 0.0))
    wrong = track(sample(0, 0, 0.0, 0.0), sample(2, 32, 0.6, 0.0), sample(1, 16, 0.5, 0.0))
    for t_ms in (4, 16, 20, 32):
        np.testing.assert_array_equal(positions(wrong.at(t_ms * MS, GAP)), positions(right.at(t_ms * MS, GAP)))
    assert wrong.newest_ns == 32 * MS
    assert not wrong.rejected


def test_a_good_sample_clears_the_last_rejection() -> None:
    t = track(sample(0, 0, 0.0, 0.0), sample(1, 16, np.nan, 0.0), sample(2, 32, 0.0, 0.1))
    assert t.last_rejection is None
    assert t.rejected[EncoderRejection.NOT_FINITE] == 1


def test_nearest_takes_the_closer_side_and_the_earlier_of_equals() -> None:
    t = track(sample(0, 0, 0.0, 0.0), sample(1, 10, 0.0, 0.1))
    assert EncoderTrack(FREE).nearest(0) is None
    for t_ms, seq in ((-50, 0), (4.9, 0), (5, 0), (5.1, 1), (10, 1), (900, 1)):
        found = t.nearest(round(t_ms * MS))
        assert found is not None
        assert found.seq == seq


def test_memory_is_bounded_over_a_long_session() -> None:
    t = EncoderTrack(FREE)
    largest = 0
    for k in range(20_000):
        t.add(sample(k, 15.6 * k, 0.0, 0.001 * (k % 7)))
        largest = max(largest, len(t))
    assert largest <= 4096
    assert not isinstance(t.at(round(15.6 * 19_990.5 * MS), GAP), Miss)
