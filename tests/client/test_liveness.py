"""Live, stale and lost, by the receiver's clock alone."""

import pytest

from ghest_rt.client.limits import Limits
from ghest_rt.client.liveness import Liveness
from ghest_rt.client.updates import LinkCause, LinkState

MS = 1_000_000
LIMITS = Limits(stale_after_s=0.150, lost_after_s=2.0, max_delay_s=0.150)
A, B = "tcp/a:1", "tcp/b:1"


def live() -> Liveness:
    liveness = Liveness("one", LIMITS, 0)
    liveness.on_connection(A, True, 0)
    liveness.on_token(A, True, 0)
    change = liveness.on_sample(A, 0.0, 10 * MS)
    assert change is not None and change.state is LinkState.LIVE
    return liveness


def state(liveness: Liveness) -> tuple[LinkState, LinkCause]:
    return liveness.link.state, liveness.link.cause


def test_before_anything_comes_it_is_lost_for_want_of_a_connection() -> None:
    assert state(Liveness("one", LIMITS, 0)) == (LinkState.LOST, LinkCause.NO_CONNECTION)


def test_a_connection_alone_is_stale_after_a_while_and_then_lost() -> None:
    liveness = Liveness("one", LIMITS, 0)
    assert liveness.on_connection(A, True, 0) is None  # the first sample may be on its way
    assert liveness.deadline_ns == 150 * MS
    assert liveness.on_time(150 * MS) is not None
    assert state(liveness) == (LinkState.STALE, LinkCause.SILENT)
    assert liveness.deadline_ns == 2000 * MS
    liveness.on_time(2000 * MS)
    assert state(liveness) == (LinkState.LOST, LinkCause.SILENT)
    assert liveness.deadline_ns is None


def test_silence_makes_it_stale_then_lost_and_a_sample_live() -> None:
    liveness = live()
    assert liveness.deadline_ns == 160 * MS
    assert liveness.on_time(159 * MS) is None
    assert liveness.on_time(160 * MS) is not None
    assert state(liveness) == (LinkState.STALE, LinkCause.SILENT)
    assert liveness.on_time(2009 * MS) is None
    assert liveness.on_time(2010 * MS) is not None
    assert state(liveness) == (LinkState.LOST, LinkCause.SILENT)
    assert liveness.on_sample(A, 0.0, 2020 * MS) is not None
    assert state(liveness) == (LinkState.LIVE, LinkCause.NONE)


def test_old_samples_do_not_make_it_live() -> None:
    liveness = live()
    liveness.on_sample(A, 151.0, 20 * MS)
    assert state(liveness) == (LinkState.STALE, LinkCause.DELAYED)
    assert liveness.on_time(170 * MS) is not None
    assert state(liveness) == (LinkState.STALE, LinkCause.SILENT)
    liveness.on_sample(A, 149.0, 180 * MS)
    assert state(liveness) == (LinkState.LIVE, LinkCause.NONE)


def test_the_withdrawn_token_means_lost_at_once_and_a_new_one_the_beginning() -> None:
    liveness = live()
    liveness.on_token(A, False, 20 * MS)
    assert state(liveness) == (LinkState.LOST, LinkCause.SERVICE_GONE)
    assert liveness.on_token(A, True, 30 * MS) is not None  # its last sample is not yet stale
    assert state(liveness) == (LinkState.LIVE, LinkCause.NONE)


def test_a_broken_connection_means_lost_at_once() -> None:
    liveness = live()
    liveness.on_connection(A, False, 20 * MS)
    assert state(liveness) == (LinkState.LOST, LinkCause.NO_CONNECTION)


def test_a_second_way_to_the_station_keeps_it_live() -> None:
    liveness = live()
    liveness.on_connection(B, True, 10 * MS)
    liveness.on_token(B, True, 10 * MS)
    assert liveness.on_token(A, False, 20 * MS) is None
    assert liveness.on_connection(A, False, 20 * MS) is None
    assert state(liveness) == (LinkState.LIVE, LinkCause.NONE)


def test_a_token_that_returns_to_a_live_station_changes_nothing() -> None:
    liveness = live()
    assert liveness.on_token(A, True, 20 * MS) is None


@pytest.mark.parametrize("values", [{"stale_after_s": 0.0}, {"stale_after_s": 3.0}, {"max_delay_s": -1.0}])
def test_limits_without_sense_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="limits"):
        Limits(**values)
