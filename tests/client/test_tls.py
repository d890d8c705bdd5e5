"""The client with an identity, against a station that listens with TLS and lets in whom it knows."""

from pathlib import Path

import pytest

from ghest_rt.client import ConnectionChanged, GhestClient, LinkState
from ghest_rt.errors import BadInputError
from ghest_rt.security.authority import Authority
from ghest_rt.security.identity_check import load_identity
from ghest_rt.security.roles import Role
from tests.client.fakes import FakeStation, Network, Told


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    return Authority.create(tmp_path_factory.mktemp("clinic"), "A clinic", 30)


@pytest.fixture(scope="module")
def station(authority: Authority) -> Path:
    authority.issue(Role.THERAPY, "game", (), 10)
    return authority.issue(Role.STATION, "bed-1", ("127.0.0.1",), 10)


@pytest.fixture(scope="module")
def therapy(authority: Authority, station: Path) -> Path:
    return station.parent / "therapy.game"


def test_everything_a_client_does_is_allowed_to_therapy_software(station: Path, therapy: Path) -> None:
    """Samples, liveliness, the last sample, missing ones, documents."""
    with (
        FakeStation(endpoint="tls/127.0.0.1:0", identity=load_identity(station)) as bed,
        Network(bed.endpoint) as network,
    ):
        bed.publish(3)
        with GhestClient(network.endpoint, identity=therapy) as client:
            told = Told(client.updates())
            told.wait(lambda: told.seqs() == [2])
            bed.publish_until(lambda: client.latest() is not None)
            network.cut()
            told.wait(lambda: client.link("one") is not None and client.link("one").state is LinkState.LOST)  # type: ignore[union-attr]
            bed.publish(50)
            network.mend()
            bed.publish_until(lambda: told.seqs()[-1] == bed.next_seq - 1 and client.latest() is not None)
            assert told.seqs() == list(range(2, bed.next_seq))
            assert told.gaps() == []
            assert isinstance(client.ask("one", "calibration"), dict)


def test_another_clinics_identity_gets_no_connection_and_goes_on_trying(station: Path, tmp_path: Path) -> None:
    stranger = Authority.create(tmp_path, "Another clinic", 30).issue(Role.THERAPY, "game", (), 10)
    with (
        FakeStation(endpoint="tls/127.0.0.1:0", identity=load_identity(station)) as bed,
        GhestClient(bed.endpoint, identity=stranger) as client,
    ):
        told = Told(client.updates())
        told.wait(lambda: any(isinstance(update, ConnectionChanged) for update in told.all), 20.0)
        bed.publish(20)
        (refused,) = [update for update in told.all if isinstance(update, ConnectionChanged)]
        assert not refused.connected and bed.endpoint in refused.detail
        assert told.seqs() == []


def test_an_identity_that_cannot_be_used_is_refused_before_anything_is_opened(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="no identity here"):
        GhestClient("tls/127.0.0.1:7447", identity=tmp_path)
