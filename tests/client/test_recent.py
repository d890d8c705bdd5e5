"""What a station still has."""

import json

from ghest_rt.service.recent import RecentSamples


def kept(capacity: int, *seqs: int) -> RecentSamples:
    recent = RecentSamples(capacity)
    for seq in seqs:
        recent.add("a", seq, json.dumps({"seq": seq}).encode())
    return recent


def asked(recent: RecentSamples, first: int, last: int, run_id: str = "a") -> list[int]:
    return [sample["seq"] for sample in json.loads(recent.page(run_id, first, last))["samples"]]


def test_the_newest_are_kept_and_given_in_order() -> None:
    recent = kept(4, *range(10))
    assert asked(recent, 0, 100) == [6, 7, 8, 9]
    assert asked(recent, 7, 8) == [7, 8]
    assert asked(recent, 0, 5) == []
    assert recent.newest == b'{"seq": 9}'


def test_another_run_is_not_mixed_in() -> None:
    recent = kept(4, 0, 1)
    assert asked(recent, 0, 1, "b") == []
    assert json.loads(recent.page("b", 0, 1))["run_id"] == "a"


def test_numbers_that_another_station_of_the_process_took_are_left_out() -> None:
    assert asked(kept(4, 0, 1, 5, 6), 0, 6) == [5, 6]


def test_before_the_first_sample_there_is_none() -> None:
    recent = RecentSamples(4)
    assert json.loads(recent.page("a", 0, 9)) == {"run_id": None, "samples": []}
    assert recent.newest is None


def test_an_answer_is_limited_in_size_whatever_is_asked() -> None:
    recent = RecentSamples(2000)
    for seq in range(2000):
        recent.add("a", seq, json.dumps({"seq": seq, "padding": "x" * 1000}).encode())
    page = recent.page("a", 0, 10**18)
    seqs = [sample["seq"] for sample in json.loads(page)["samples"]]
    assert len(page) < 300_000
    assert seqs == list(range(len(seqs))) and len(seqs) > 200
