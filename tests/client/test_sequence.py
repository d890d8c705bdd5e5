"""Every sample once, in order; what is missing is asked for and else told."""

from hypothesis import given, settings
from hypothesis import strategies as st

from ghest_rt.client.sequence import FillRequest, Ordered, Sequence
from ghest_rt.client.updates import Gap, GapCause, Restarted, Sample
from tests.client.fakes import message

WAIT_NS = 500


def sample(seq: int, run_id: str = "a") -> Sample:
    return Sample("one", message(seq, run_id), 0, 0.0)


def seqs(out: list[Ordered]) -> list[int]:
    return [item.message.seq for item in out if isinstance(item, Sample)]


def test_samples_in_order_pass_at_once_from_wherever_one_joins() -> None:
    sequence = Sequence("one", WAIT_NS)
    assert [seqs(sequence.accept(sample(seq), 0)) for seq in (7, 8, 9)] == [[7], [8], [9]]
    assert sequence.take_request() is None
    assert sequence.deadline_ns is None


def test_repeated_and_older_samples_are_passed_over() -> None:
    sequence = Sequence("one", WAIT_NS)
    for seq in (7, 8):
        sequence.accept(sample(seq), 0)
    assert [sequence.accept(sample(seq), 0) for seq in (8, 7, 6)] == [[], [], []]


def test_missing_samples_are_asked_for_once_and_newer_ones_wait() -> None:
    sequence = Sequence("one", WAIT_NS)
    sequence.accept(sample(1), 0)
    assert sequence.accept(sample(4), 10) == []
    request = sequence.take_request()
    assert request == FillRequest("one", "a", 2, 3)
    assert sequence.take_request() is None
    assert sequence.accept(sample(5), 20) == []
    assert seqs(sequence.answer(request, [sample(2), sample(3)], 30)) == [2, 3, 4, 5]
    assert sequence.deadline_ns is None


def test_what_the_station_no_longer_has_is_a_gap() -> None:
    sequence = Sequence("one", WAIT_NS)
    sequence.accept(sample(1), 0)
    sequence.accept(sample(6), 0)
    request = sequence.take_request()
    assert request is not None
    out = sequence.answer(request, [sample(4), sample(5)], 0)
    assert out[0] == Gap("one", "a", 2, 3, GapCause.UNFILLED)
    assert out[0].count == 2
    assert seqs(out) == [4, 5, 6]


def test_without_an_answer_the_wait_ends_and_the_gap_is_told() -> None:
    sequence = Sequence("one", WAIT_NS)
    sequence.accept(sample(1), 0)
    sequence.accept(sample(3), 100)
    assert sequence.deadline_ns == 100 + WAIT_NS
    assert sequence.expire(99 + WAIT_NS) == []
    out = sequence.expire(100 + WAIT_NS)
    assert out[0] == Gap("one", "a", 2, 2, GapCause.UNFILLED)
    assert seqs(out) == [3]


def test_an_answer_that_comes_too_late_changes_nothing() -> None:
    sequence = Sequence("one", WAIT_NS)
    sequence.accept(sample(1), 0)
    sequence.accept(sample(3), 0)
    request = sequence.take_request()
    sequence.expire(WAIT_NS)
    assert request is not None
    assert sequence.answer(request, [sample(2)], WAIT_NS) == []


def test_an_answer_in_pages_is_asked_on_for() -> None:
    sequence = Sequence("one", WAIT_NS)
    sequence.accept(sample(0), 0)
    sequence.accept(sample(9), 0)
    request = sequence.take_request()
    assert request is not None
    assert sequence.answer(request, [sample(seq) for seq in range(1, 5)], 100) == []
    request = sequence.take_request()
    assert request == FillRequest("one", "a", 5, 8)
    assert sequence.deadline_ns == 100 + WAIT_NS
    assert seqs(sequence.answer(request, [sample(seq) for seq in range(5, 9)], 100)) == list(range(1, 10))


def test_an_answer_without_what_was_asked_for_ends_the_asking() -> None:
    sequence = Sequence("one", WAIT_NS)
    sequence.accept(sample(5), 0)
    sequence.accept(sample(9), 0)
    request = sequence.take_request()
    assert request is not None
    out = sequence.answer(request, [sample(1), sample(2)], 0)
    assert out[0] == Gap("one", "a", 6, 8, GapCause.UNFILLED)
    assert sequence.take_request() is None


def test_with_filling_switched_off_a_gap_is_told_at_once() -> None:
    sequence = Sequence("one", None)
    sequence.accept(sample(1), 0)
    out = sequence.accept(sample(3), 0)
    assert out[0] == Gap("one", "a", 2, 2, GapCause.UNFILLED)
    assert seqs(out) == [3]


def test_another_run_is_a_restart_and_no_gap() -> None:
    sequence = Sequence("one", WAIT_NS)
    sequence.accept(sample(500), 0)
    out = sequence.accept(sample(600, "b"), 0)
    assert out[0] == Restarted("one", "b", 600)
    assert seqs(out) == [600]
    assert sequence.accept(sample(501), 0) == []  # of the run before: too late


def test_what_waited_when_the_run_ended_is_still_handed_out() -> None:
    sequence = Sequence("one", WAIT_NS)
    sequence.accept(sample(1), 0)
    sequence.accept(sample(3), 0)
    out = sequence.accept(sample(0, "b"), 0)
    assert out[0] == Gap("one", "a", 2, 2, GapCause.UNFILLED)
    assert seqs(out) == [3, 0]
    assert isinstance(out[2], Restarted)
    assert seqs(sequence.accept(sample(1, "b"), 0)) == [1]


@settings(max_examples=200, deadline=None)
@given(
    came=st.lists(st.integers(0, 30), min_size=1, max_size=60),
    kept_from=st.integers(0, 30),
    page=st.integers(1, 4),
    answers=st.lists(st.booleans(), min_size=60, max_size=60),
)
def test_whatever_comes_in_whatever_order_every_number_is_told_exactly_once(
    came: list[int], kept_from: int, page: int, answers: list[bool]
) -> None:
    """Samples lost, repeated and out of order; a station that answers or not, in pages, and has only the newest."""
    sequence = Sequence("one", WAIT_NS)
    out: list[Ordered] = []
    newest = 0
    for t_ns, (seq, answered) in enumerate(zip(came, answers, strict=False)):
        newest = max(newest, seq)
        out += sequence.accept(sample(seq), t_ns)
        while answered and (request := sequence.take_request()) is not None:
            first = max(kept_from, request.first_seq)
            out += sequence.answer(request, [sample(k) for k in range(first, request.last_seq + 1)[:page]], t_ns)
        out += sequence.expire(t_ns)
    out += sequence.expire(10**6)
    out += sequence.expire(2 * 10**6)  # a second hole behind the first
    told: list[int] = []
    for item in out:
        assert not isinstance(item, Restarted)
        told += [item.message.seq] if isinstance(item, Sample) else range(item.first_seq, item.last_seq + 1)
    while (deadline_ns := sequence.deadline_ns) is not None:
        for item in sequence.expire(deadline_ns):
            assert not isinstance(item, Restarted)
            told += [item.message.seq] if isinstance(item, Sample) else range(item.first_seq, item.last_seq + 1)
    assert told == list(range(came[0], newest + 1))
