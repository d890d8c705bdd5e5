"""A Zenoh router between station and client."""

import json

from ghest_rt.client import ConnectionChanged, GhestClient
from tests.client.fakes import FakeStation, Told
from tests.client.processes import answer, process, tell
from tests.endpoints import free_endpoint


def test_a_router_in_between_changes_nothing() -> None:
    endpoint = free_endpoint()
    with (
        process("route", endpoint),
        process("publish", endpoint, "router", 2000, 0.0003) as station,
        process("subscribe", endpoint, 1999) as subscriber,
    ):
        tell(station)
        heard = json.loads(answer(subscriber))
    assert heard["gaps"] == 0
    assert heard["seqs"] == list(range(heard["seqs"][0], 2000))


def test_after_a_restart_of_the_router_all_is_as_before_and_what_was_missed_is_filled() -> None:
    endpoint = free_endpoint()
    with process("route", endpoint) as router, FakeStation(router=endpoint) as station, GhestClient(endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: client.latest() is not None)
        router.kill()
        station.publish_until(lambda: any(isinstance(u, ConnectionChanged) and not u.connected for u in told.all))
        assert client.latest() is None
        with process("route", endpoint):
            back = station.publish_until(lambda: client.latest() is not None)
            station.publish_until(lambda: told.seqs()[-1] >= station.next_seq - 2)
            assert told.seqs() == list(range(told.seqs()[0], told.seqs()[-1] + 1))
            assert told.gaps() == []
    assert back <= 200  # slots of 15 ms: 3 s
