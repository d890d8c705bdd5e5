"""Subscribers that hang harm neither the station nor others."""

import signal

import pytest

from ghest_rt.client import GhestClient
from tests.client.fakes import FakeStation, Told
from tests.client.processes import process


@pytest.mark.parametrize(("how", "rounds"), [("callback", 20), ("stopped", 100)])
def test_a_subscriber_that_hangs_harms_neither_the_station_nor_others(how: str, rounds: int) -> None:
    """10,000 samples are more than the connection to a stopped process takes."""
    with FakeStation() as station, process("hang", station.endpoint) as hanging, GhestClient(station.endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: client.latest() is not None)
        if how == "stopped":
            hanging.send_signal(signal.SIGSTOP)
        for _ in range(rounds):
            station.publish(100)
            told.wait(lambda: told.seqs()[-1] == station.next_seq - 1)
        assert told.seqs() == list(range(told.seqs()[0], station.next_seq))
        assert told.gaps() == []
