"""A slow receiver costs itself samples, and knows which."""

import asyncio

import pytest

from ghest_rt.client.mailbox import Updates
from ghest_rt.client.updates import Gap, GapCause, LinkCause, LinkChanged, LinkState, Sample, Update
from tests.client.fakes import message


def sample(seq: int, run_id: str = "a") -> Sample:
    return Sample("one", message(seq, run_id), 0, 0.0)


def everything(updates: Updates) -> list[Update]:
    taken = []
    while (update := updates.get(0.0)) is not None:
        taken.append(update)
    return taken


def make(capacity: int) -> Updates:
    return Updates(capacity)


def test_what_was_not_taken_in_time_is_told_as_one_gap_before_the_rest() -> None:
    updates = make(3)
    for seq in range(8):
        updates.put(sample(seq))
    assert everything(updates) == [Gap("one", "a", 0, 4, GapCause.OVERRUN), sample(5), sample(6), sample(7)]


def test_a_gap_that_was_dropped_is_part_of_the_gap_told() -> None:
    updates = make(1)
    for update in (sample(0), Gap("one", "a", 1, 3, GapCause.UNFILLED), sample(4)):
        updates.put(update)
    assert everything(updates) == [Gap("one", "a", 0, 3, GapCause.OVERRUN), sample(4)]


def test_runs_are_not_mixed_up_and_the_newest_state_survives() -> None:
    updates = make(1)
    stale = LinkChanged("one", LinkState.STALE, LinkCause.SILENT, 1)
    live = LinkChanged("one", LinkState.LIVE, LinkCause.NONE, 2)
    for update in (sample(5), stale, live, sample(0, "b"), sample(1, "b")):
        updates.put(update)
    first, second, third, fourth = everything(updates)
    assert [first, second] == [Gap("one", "a", 5, 5, GapCause.OVERRUN), Gap("one", "b", 0, 0, GapCause.OVERRUN)]
    assert (third, fourth) == (live, sample(1, "b"))


def test_get_gives_up_when_time_is_up_and_when_nothing_more_comes() -> None:
    updates = make(3)
    assert updates.get(0.01) is None
    assert not updates.closed
    assert updates.put(sample(0))
    updates.close()
    assert not updates.put(sample(1))
    assert updates.get() == sample(0)
    assert updates.get() is None
    assert updates.closed


async def test_an_asynchronous_receiver_gets_them_from_another_thread_and_then_the_end() -> None:
    updates = make(10)

    def feed() -> None:
        for seq in range(5):
            updates.put(sample(seq))
        updates.close()

    feeding = asyncio.get_running_loop().run_in_executor(None, feed)
    assert [update async for update in updates] == [sample(seq) for seq in range(5)]
    await feeding


async def test_a_waiting_receiver_can_be_cancelled_and_go_on_later() -> None:
    updates = make(10)
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(anext(updates), 0.01)
    updates.put(sample(0))
    assert await asyncio.wait_for(anext(updates), 5.0) == sample(0)


def test_a_capacity_without_sense_is_refused() -> None:
    with pytest.raises(ValueError, match="capacity"):
        make(0)
