"""The client against a publisher, over real sessions and a network that fails."""

import logging
import threading
import time

import pytest

from ghest_rt.client import (
    ConnectionChanged,
    EventReport,
    GhestClient,
    Limits,
    LinkCause,
    LinkState,
    Refused,
    Restarted,
    Sample,
    Update,
)
from ghest_rt.errors import BadInputError, GhestError
from tests.client.fakes import NOTHING, SLOT_NS, FakeStation, Network, Told, message, wait


def state_of(client: GhestClient, station: str = "one") -> tuple[LinkState, LinkCause] | None:
    link = client.link(station)
    return None if link is None else (link.state, link.cause)


async def test_samples_come_in_order_through_the_asynchronous_iterator() -> None:
    with FakeStation() as station:
        async with GhestClient(station.endpoint) as client:
            updates = client.updates()
            publishing = threading.Thread(target=station.publish, args=(60, 0.005))
            publishing.start()
            seqs: list[int] = []
            async for update in updates:
                if isinstance(update, Sample):
                    seqs.append(update.message.seq)
                    if update.message.seq == 59:
                        break
            publishing.join()
    assert seqs == list(range(seqs[0], 60))


def test_who_comes_late_gets_the_last_sample_but_not_as_a_new_one() -> None:
    with FakeStation() as station:
        station.publish(7)
        with GhestClient(station.endpoint) as client:
            told = Told(client.updates())
            told.wait(lambda: told.seqs() == [6])
            assert told.samples()[0].recovered
            assert told.samples()[0].age_s(time.monotonic_ns()) == float("inf")
            assert client.latest() is None
            told.wait(lambda: state_of(client) == (LinkState.STALE, LinkCause.SILENT))
            station.publish()
            told.wait(lambda: told.seqs() == [6, 7])
            assert not told.samples()[1].recovered


def test_what_a_cut_of_the_network_swallowed_is_filled() -> None:
    with FakeStation() as station, Network(station.endpoint) as network, GhestClient(network.endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: len(told.seqs()) > 10)
        network.cut()
        told.wait(lambda: state_of(client) == (LinkState.LOST, LinkCause.NO_CONNECTION))
        station.publish(50)
        network.mend()
        station.publish_until(lambda: bool(told.seqs()) and told.seqs()[-1] == station.next_seq - 1 and len(told.seqs()) > 70)
        seqs = told.seqs()
        assert seqs == list(range(seqs[0], seqs[-1] + 1))
        assert told.gaps() == []
        assert sum(sample.recovered for sample in told.samples()) >= 50
        changes = [update.connected for update in told.all if isinstance(update, ConnectionChanged)]
        assert changes[:3] == [True, False, True]


def test_without_filling_the_same_cut_is_a_gap() -> None:
    with (
        FakeStation() as station,
        Network(station.endpoint) as network,
        GhestClient(network.endpoint, fill_gaps=False) as client,
    ):
        told = Told(client.updates())
        station.publish_until(lambda: len(told.seqs()) > 10)
        network.cut()
        told.wait(lambda: state_of(client) == (LinkState.LOST, LinkCause.NO_CONNECTION))
        station.publish(50)
        network.mend()
        station.publish_until(lambda: bool(told.gaps()))
        (gap,) = told.gaps()
        assert gap.count >= 50 - 1  # the last one published in the meantime is what a late joiner gets
        assert gap.last_seq < station.next_seq


def test_samples_that_were_held_up_on_the_way_are_never_the_present() -> None:
    with FakeStation() as station, Network(station.endpoint) as network, GhestClient(network.endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: len(told.seqs()) > 20 and client.latest() is not None)
        network.hold()
        station.publish(40, period_s=0.015)
        assert client.latest() is None
        assert state_of(client) in ((LinkState.STALE, LinkCause.SILENT), (LinkState.LOST, LinkCause.SILENT))
        held = range(station.next_seq - 40, station.next_seq)
        network.release()
        told.wait(lambda: bool(told.seqs()) and told.seqs()[-1] >= held[-1])
        delays_ms = {sample.message.seq: sample.delay_ms for sample in told.samples()}
        assert delays_ms[held[2]] > 300.0
        assert told.seqs() == list(range(told.seqs()[0], told.seqs()[-1] + 1))
        found: list[Sample | None] = []
        station.publish_until(lambda: found.append(client.latest()) or found[-1] is not None)  # type: ignore[func-returns-value]
        assert found[-1] is not None and found[-1].delay_ms < 150.0


def test_a_service_started_anew_is_a_restart_and_no_gap() -> None:
    with FakeStation(run_id="first") as station, Network(station.endpoint) as network, GhestClient(network.endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: len(told.seqs()) > 10)
        station.close()
        told.wait(
            lambda: state_of(client) in ((LinkState.LOST, LinkCause.SERVICE_GONE), (LinkState.LOST, LinkCause.NO_CONNECTION))
        )
        with FakeStation(run_id="second", endpoint=station.endpoint) as again:
            again.next_seq = 3
            again.publish_until(lambda: any(sample.message.run_id == "second" for sample in told.samples()))
            (restart,) = [update for update in told.all if isinstance(update, Restarted)]
            assert (restart.station, restart.run_id) == ("one", "second")
            assert told.gaps() == []


def test_a_callback_that_hangs_costs_nobody_else_anything(caplog: pytest.LogCaptureFixture) -> None:
    free = threading.Event()

    def hang(update: Update) -> None:
        free.wait(20.0)

    def fail(update: Update) -> None:
        raise RuntimeError("the game has crashed")

    with (
        caplog.at_level(logging.CRITICAL),
        FakeStation() as station,
        GhestClient(station.endpoint) as stuck,
        GhestClient(station.endpoint) as other,
        stuck.on_update(hang, capacity=10),
        stuck.on_update(fail),
    ):
        beside, elsewhere = Told(stuck.updates()), Told(other.updates())
        station.publish_until(lambda: len(beside.seqs()) > 5 and len(elsewhere.seqs()) > 5)
        station.publish(200, period_s=0.001)
        for told in (beside, elsewhere):
            told.wait(lambda told=told: told.seqs()[-1] == station.next_seq - 1)  # type: ignore[misc]
            assert told.seqs() == list(range(told.seqs()[0], station.next_seq))
        free.set()


def test_several_stations_at_one_place_and_at_several_are_told_apart() -> None:
    with FakeStation("one") as one, FakeStation("two") as two, GhestClient((one.endpoint, two.endpoint)) as client:
        told = Told(client.updates())
        told.wait(lambda: client.stations() == ("one", "two"))
        one.publish_until(lambda: client.latest("one") is not None)
        assert state_of(client, "two") != (LinkState.LIVE, LinkCause.NONE)
        with pytest.raises(BadInputError, match="one, two"):
            client.latest()
        two.publish(5)
        told.wait(lambda: {sample.station for sample in told.samples()} == {"one", "two"})


def test_only_the_stations_named_are_heard() -> None:
    with FakeStation("two") as two, GhestClient(two.endpoint, stations="one", limits=Limits(lost_after_s=0.4)) as client:
        told = Told(client.updates())
        told.wait(lambda: any(isinstance(update, ConnectionChanged) for update in told.all))
        two.publish(30, period_s=0.005)
        assert told.seqs() == []
        assert client.stations() == ("one",)
        told.wait(lambda: state_of(client) == (LinkState.LOST, LinkCause.SILENT))


def test_a_station_that_is_not_there_yet_is_waited_for_and_the_reason_told() -> None:
    with FakeStation() as station:
        endpoint = station.endpoint
    with GhestClient(endpoint, stations="one") as client:
        told = Told(client.updates())
        told.wait(lambda: any(isinstance(update, ConnectionChanged) for update in told.all))
        (refused,) = [update for update in told.all if isinstance(update, ConnectionChanged)]
        assert not refused.connected and endpoint in refused.detail
        assert state_of(client) == (LinkState.LOST, LinkCause.NO_CONNECTION)
        with FakeStation(endpoint=endpoint) as station:
            station.publish_until(lambda: client.latest("one") is not None)


def test_events_come_and_documents_can_be_asked_for() -> None:
    with FakeStation() as station, GhestClient(station.endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: client.latest("one") is not None)
        station.event("hello", seq=3)
        station.event("again", seq=6)
        told.wait(lambda: len([update for update in told.all if isinstance(update, EventReport)]) == 2)
        events = [update for update in told.all if isinstance(update, EventReport)]
        assert [(event.message.message, event.missed) for event in events] == [("hello", 0), ("again", 2)]
        calibration = client.ask("one", "calibration")
        assert isinstance(calibration, dict) and "m0_from_gh" in calibration
        with pytest.raises(GhestError, match="nobody"):
            client.ask("nobody", "calibration", timeout_s=0.2)


def test_a_question_waits_for_the_connection() -> None:
    with FakeStation() as station, GhestClient(station.endpoint) as client:
        assert isinstance(client.ask("one", "schema"), dict)


def test_a_message_that_cannot_be_read_is_told_once() -> None:
    with FakeStation() as station, GhestClient(station.endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: bool(told.seqs()))
        for _ in range(3):
            station.session.put("ghest/one/gh/angles", b'{"schema_version": 2}')
        station.publish(3)
        told.wait(lambda: told.seqs()[-1] == station.next_seq - 1)
        assert len([update for update in told.all if isinstance(update, Refused)]) == 1


def test_a_receiver_that_joins_later_is_told_how_things_stand_and_one_that_left_nothing() -> None:
    with FakeStation() as station, GhestClient(station.endpoint) as client:
        first = Told(client.updates())
        station.publish_until(lambda: client.latest() is not None)
        second = Told(client.updates())
        wait(lambda: len(second.all) >= 3)
        assert isinstance(second.all[0], ConnectionChanged)
        assert second.seqs() == [first.seqs()[-1]]
        first.updates.close()
        count = len(first.all)
        station.publish_until(lambda: second.seqs()[-1] >= station.next_seq - 1 and len(second.seqs()) > 20)
        assert len(first.all) == count


def test_closing_ends_those_who_wait() -> None:
    with GhestClient("tcp/127.0.0.1:9") as client:
        updates = client.updates()
        taken: list[Update | None] = []
        waiting = threading.Thread(target=lambda: taken.extend(iter(updates.get, None)))
        waiting.start()
    waiting.join(5.0)
    assert not waiting.is_alive()
    assert updates.closed


@pytest.mark.parametrize(
    ("connect", "stations", "named"),
    [("7447", "*", "7447"), ("tcp/10.0.0.7:7447", "*", "identity"), ("tcp/127.0.0.1:7447", "a/b", "a/b")],
)
def test_what_cannot_be_meant_is_refused_at_once(connect: str, stations: str, named: str) -> None:
    with pytest.raises(BadInputError, match=named):
        GhestClient(connect, stations=stations)


def test_a_peer_that_makes_up_stations_does_not_fill_the_memory() -> None:
    with FakeStation() as station, GhestClient(station.endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: bool(told.seqs()))
        for k in range(300):
            station.session.put(f"ghest/made-up-{k}/gh/angles", message(0).model_dump_json().encode())
        station.publish(3)
        told.wait(lambda: [s.message.seq for s in told.samples() if s.station == "one"][-1] == station.next_seq - 1)
        assert len(client.stations()) == 256


def test_a_recording_that_begins_again_is_no_delay() -> None:
    """With `--speed max` times are the recording's."""
    with FakeStation() as station, GhestClient(station.endpoint) as client:
        told = Told(client.updates())
        station.publish_until(lambda: client.latest() is not None)
        first_seq = station.next_seq
        for k in range(first_seq, first_seq + 50):
            station.publisher.angles(message(k, station.run_id, (k % 20) * 20 * SLOT_NS), NOTHING)
            time.sleep(0.002)
        told.wait(lambda: told.seqs()[-1] == first_seq + 49)
        assert max(sample.delay_ms for sample in told.samples() if sample.message.seq >= first_seq) < 2000.0


def test_a_second_service_under_the_same_id_is_told_and_its_angles_are_not_mixed_in() -> None:
    with (
        FakeStation(run_id="first") as first,
        FakeStation(run_id="second") as second,
        GhestClient((first.endpoint, second.endpoint)) as client,
    ):
        told = Told(client.updates())
        first.publish_until(lambda: client.latest() is not None)
        second.publish_until(lambda: any(sample.message.run_id == "second" for sample in told.samples()))
        first.publish_until(lambda: any(isinstance(update, Refused) for update in told.all))
        (refused,) = [update for update in told.all if isinstance(update, Refused)]
        assert "two services" in refused.detail and "station.id" in refused.detail
        runs: list[str] = []

        def look() -> bool:
            first.publish()
            sample = client.latest()
            runs.extend([] if sample is None else [sample.message.run_id])
            return len(runs) > 10

        second.publish_until(look)
        assert set(runs) == {"second"}
