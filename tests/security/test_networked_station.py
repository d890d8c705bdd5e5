"""The shipped example of a networked station."""

import shutil
from pathlib import Path

from ghest_rt.cli.publishing import Publishing
from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.security.identity_check import load_identity
from ghest_rt.security.session import open_session
from tests.security.clinic import Clinic

EXAMPLE = shipped_config_dir() / "examples" / "networked" / "station.toml"


def test_the_example_listens_with_tls_alone_by_the_identity_beside_it(clinic: Clinic, tmp_path: Path) -> None:
    config = load_station(EXAMPLE).config
    assert all(endpoint.startswith("tls/") for endpoint in config.publisher.listen)
    shutil.copytree(clinic.station, tmp_path / str(config.publisher.identity))
    with Publishing(config.publisher, "tls/127.0.0.1:0", True, False, tmp_path) as publishing:
        assert publishing.publisher_for(config) is not None
        therapy, _ = open_session((), publishing.endpoints, load_identity(clinic.therapy), "client")
        with therapy:
            answers = list(therapy.get(f"ghest/{config.station.id}/config", timeout=5.0))
    assert [reply.ok is not None for reply in answers] == [True]


def test_the_example_differs_from_the_simulated_station_in_nothing_else() -> None:
    example, plain = load_station(EXAMPLE).config, load_station(shipped_config_dir() / "station-sim.toml").config
    apart = {"station", "exoskeleton", "publisher", "recorder"}
    assert example.model_dump(exclude=apart) == plain.model_dump(exclude=apart)
