"""Stations that listen on their own machine alone, reached through the gateway."""

import contextlib
import re
import socket
import subprocess
import threading
import time

import pytest
import zenoh

from ghest_rt.cli.gateway import DEFAULT_LISTEN, DEFAULT_STATION
from ghest_rt.cli.station_watch import StationWatch
from ghest_rt.config.shipped import shipped_systemd_dir
from ghest_rt.config.station import Publisher
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.security.endpoints import split_endpoint
from ghest_rt.security.gateway import Gateway
from ghest_rt.security.identity_check import load_identity
from ghest_rt.security.session import open_session
from tests.program import COMMAND
from tests.security.clinic import Clinic
from tests.security.raw import open_raw

KEY, LAST, CALIBRATE = "ghest/sim/gh/angles", "ghest/sim/last", "ghest/sim/calibrate/run"


class Bench:
    """A station on loopback and a gateway process before it."""

    def __init__(self, clinic: Clinic) -> None:
        self.session, (self.inside,) = open_session(("tcp/127.0.0.1:0",))
        self.forged = threading.Event()
        self.calibrated = threading.Event()
        self._declared = [
            self.session.declare_queryable(LAST, lambda query: query.reply(LAST, b'"last"')),
            self.session.declare_queryable(CALIBRATE, self._calibrate),
            self.session.declare_subscriber(
                "ghest/**", lambda s: self.forged.set() if b"forged" in s.payload.to_bytes() else None
            ),
        ]
        self.publisher = self.session.declare_publisher(KEY)
        command = [*COMMAND, "gateway", "--identity", str(clinic.router)]
        self.process = subprocess.Popen(
            [*command, "--listen", "tls/127.0.0.1:0", "--station", self.inside], stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        self.outside = self.process.stdout.readline().split()[0]

    def _calibrate(self, query: zenoh.Query) -> None:
        self.calibrated.set()
        query.reply(CALIBRATE, b'"done"')

    def reads(self, session: zenoh.Session) -> bool:
        """Whether a published sample reaches the session within two seconds."""
        got = threading.Event()
        with session.declare_subscriber("ghest/*/gh/angles", lambda _: got.set()):
            for _ in range(100):
                self.publisher.put(b"{}")
                if got.wait(0.02):
                    return True
        return False

    def close(self) -> None:
        self.process.terminate()
        self.process.communicate(timeout=20)
        self.session.close()


@pytest.fixture(scope="module")
def bench(clinic: Clinic):
    bench = Bench(clinic)
    yield bench
    bench.close()


def answers(session: zenoh.Session, key: str) -> int:
    return sum(reply.ok is not None for reply in session.get(key, timeout=1.0))


def test_roles_hold_through_the_gateway(bench: Bench, clinic: Clinic) -> None:
    therapy, _ = open_session((), (bench.outside,), load_identity(clinic.therapy), "client")
    with therapy:
        assert bench.reads(therapy)
        assert answers(therapy, "ghest/*/last") == 1
        assert answers(therapy, CALIBRATE) == answers(therapy, "ghest/**") == 0
        therapy.put(KEY, b"forged")
        therapy.put(CALIBRATE, b"forged")
        assert not bench.calibrated.is_set()
    operator, _ = open_session((), (bench.outside,), load_identity(clinic.operator), "client")
    with operator:
        assert bench.reads(operator)
        assert answers(operator, CALIBRATE) == 1
    assert not bench.forged.is_set()


@pytest.mark.parametrize("who", ["revoked", "other_station"])
def test_who_is_not_listed_for_it_gets_nothing(bench: Bench, clinic: Clinic, who: str) -> None:
    session, _ = open_session((), (bench.outside,), load_identity(getattr(clinic, who)), "client")
    with session:
        assert not bench.reads(session)
        assert answers(session, LAST) == 0


def test_nobody_poses_as_the_local_station(bench: Bench) -> None:
    """The gateway trusts its own connections without TLS, and takes none from others."""
    _, host, port = split_endpoint(bench.outside)
    with open_raw([f"tcp/{host}:{port}"]) as session:
        assert not bench.reads(session)


@pytest.mark.parametrize("who", ["foreign", "expired"])
def test_a_refusal_is_told_in_words(bench: Bench, clinic: Clinic, who: str) -> None:
    folder = getattr(clinic, who)
    if who == "expired":
        with pytest.raises(BadInputError, match="expired on"):
            load_identity(folder)
        return
    (folder / "ca.pem").write_bytes((folder.parents[1] / "ca.pem").read_bytes())
    with pytest.raises(GhestError, match="does not trust the station"):
        open_session((), (bench.outside,), load_identity(folder), "client")


def test_a_flood_of_handshakes_does_not_use_up_the_files(clinic: Clinic) -> None:
    station, (inside,) = open_session(("tcp/127.0.0.1:0",))
    stop = threading.Event()
    with station:
        gateway = Gateway(("tls/127.0.0.1:0",), (inside,), load_identity(clinic.router), most_files=200)
        thread = threading.Thread(target=gateway.run, args=(stop,))
        thread.start()
        _, host, port = split_endpoint(gateway.endpoints[0])
        deadline_s = time.monotonic() + 60.0
        while not gateway.reopened and time.monotonic() < deadline_s:
            with contextlib.suppress(OSError), socket.create_connection((host, port)) as link:
                link.sendall(bytes(100))
        operator = None
        while operator is None and time.monotonic() < deadline_s:
            with contextlib.suppress(GhestError):  # what the flood left behind goes first
                operator, _ = open_session((), (gateway.endpoints[0],), load_identity(clinic.operator), "client")
        assert operator is not None
        got = threading.Event()
        with operator, operator.declare_subscriber("ghest/*/gh/angles", lambda _: got.set()):
            while not got.wait(0.05) and time.monotonic() < deadline_s:
                station.put(KEY, b"{}")
        stop.set()
        thread.join()
        gateway.close()
    assert gateway.reopened
    assert got.is_set()


def test_status_sees_stations_through_the_gateway(bench: Bench, clinic: Clinic) -> None:
    with (
        bench.session.liveliness().declare_token("ghest/sim/alive"),
        StationWatch((bench.outside,), "*", clinic.therapy, time.monotonic) as watch,
    ):
        deadline_s = time.monotonic() + 20.0
        while not watch.stations():
            assert time.monotonic() < deadline_s, watch.troubles()
            time.sleep(0.05)
    assert watch.stations()["sim"].alive


def test_gateway_and_station_as_shipped_do_not_ask_for_the_same_port() -> None:
    station = {split_endpoint(endpoint)[2] for endpoint in Publisher().listen}
    assert {split_endpoint(DEFAULT_STATION)[2]} == station
    unit = (shipped_systemd_dir() / "ghest-rt-gateway.service").read_text()
    for text in (DEFAULT_LISTEN, re.search(r"--listen (\S+)", unit)[1]):
        assert split_endpoint(text)[2] not in station


@pytest.mark.parametrize("station", ["tcp/10.0.0.1:7447", "tls/127.0.0.1:7447"])
def test_a_gateways_stations_are_on_its_machine(clinic: Clinic, station: str) -> None:
    with pytest.raises(BadInputError, match="of its own machine"):
        Gateway(("tls/127.0.0.1:0",), (station,), load_identity(clinic.router))


def test_on_its_own_machine_too_only_the_station_publishes() -> None:
    station, (endpoint,) = open_session(("tcp/127.0.0.1:0",))
    honest, _ = open_session((), (endpoint,), None, "client")
    attacker, _ = open_session((), (endpoint,), None, "client")
    seen: list[str] = []
    with (
        station,
        honest,
        attacker,
        station.declare_queryable(LAST, lambda query: query.reply(LAST, b"true")),
        honest.declare_subscriber("ghest/**", lambda sample: seen.append(sample.payload.to_string())),
        attacker.declare_queryable("ghest/*/last", lambda query: query.reply(query.key_expr, b"forged")),
        attacker.liveliness().declare_token("ghest/forged/alive"),
    ):
        for key in (KEY, "ghest/**", "**"):
            attacker.put(key, b"forged")
        for _ in range(100):
            station.put(KEY, b"true")
            if seen:
                break
            time.sleep(0.02)
        time.sleep(0.3)
        assert {reply.ok.payload.to_string() for reply in honest.get("ghest/*/last", timeout=1.0) if reply.ok} == {"true"}
        assert not list(honest.liveliness().get("ghest/*/alive", timeout=0.5))
    assert set(seen) == {"true"}
