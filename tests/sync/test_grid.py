"""The output grid."""

from fractions import Fraction

import pytest

from ghest_rt.errors import BadInputError
from ghest_rt.sync.grid import Grid


def test_the_grid_never_drifts() -> None:
    grid = Grid(5_000, 66.6)
    week = 66 * 3600 * 24 * 7
    for k in (0, 1, 2, 333, 66_600, week):
        assert abs(grid.at(k) - 5_000 - k * Fraction(10**10, 666)) <= Fraction(1, 2)
    assert grid.at(666) - grid.at(0) == 10 * 10**9


def test_spacing_is_even_to_a_nanosecond() -> None:
    grid = Grid(0, 66.6)
    assert {grid.at(k + 1) - grid.at(k) for k in range(5_000)} == {15_015_015, 15_015_016}


def test_the_grid_is_where_a_recording_at_that_rate_has_its_frames() -> None:
    grid = Grid(0, 66.6)
    assert all(abs(grid.at(k) - round(k / 66.6 * 1e9)) <= 1 for k in range(5_000))


@pytest.mark.parametrize("rate_hz", [1.0, 30.0, 60.0, 66.6, 200.0])
def test_index_from_finds_the_first_instant_not_earlier(rate_hz: float) -> None:
    grid = Grid(123_456_789, rate_hz)
    for k in (0, 1, 17, 100_000):
        t_ns = grid.at(k)
        assert grid.index_from(t_ns) == k
        assert grid.index_from(t_ns + 1) == k + 1
        assert grid.index_from(t_ns - 1) == k
    assert grid.at(grid.index_from(0)) >= 0


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("nan"), float("inf")])
def test_a_rate_that_is_none_is_refused(rate_hz: float) -> None:
    with pytest.raises(BadInputError, match="rate_hz"):
        Grid(0, rate_hz)
