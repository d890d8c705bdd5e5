"""A gateway installed beside the stations, into a folder that stands for a system."""

import shutil
import stat
from pathlib import Path

import pytest

from ghest_rt.security.authority import Authority
from ghest_rt.security.roles import Role
from tests.systemd.conftest import PROGRAM, STATION, Install, needs_systemd
from tests.systemd.system import TARGETS, analyze, files_in, other_station

pytestmark = needs_systemd

UNIT = "etc/systemd/system/ghest-rt-gateway.service"
IDENTITY = "etc/ghest-rt/gateway"


@pytest.fixture(scope="module")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    return Authority.create(tmp_path_factory.mktemp("pki") / "pki", "Clinic A", 30)


@pytest.fixture(scope="module")
def router(authority: Authority) -> Path:
    return authority.issue(Role.ROUTER, "hall", ["127.0.0.1"], 10)


def test_the_gateway_comes_with_its_identity_and_goes_with_the_last_station(install: Install, root: Path, router: Path) -> None:
    before = files_in(root)
    done = install("--station", STATION, "--gateway", router)
    assert done.returncode == 0, done.stderr
    assert f"ExecStart={PROGRAM} gateway" in (root / UNIT).read_text()
    for name in ("ca.pem", "certificate.pem", "key.pem", "access.json"):
        assert (root / IDENTITY / name).read_bytes() == (router / name).read_bytes()
    assert stat.S_IMODE((root / IDENTITY / "key.pem").stat().st_mode) == 0o600
    wants = root / "etc/systemd/system/multi-user.target.wants"
    assert {path.name for path in wants.iterdir()} == {"ghest-rt.service", "ghest-rt-gateway.service"}
    assert install("--uninstall").returncode == 0
    assert files_in(root) == before


def test_the_installed_gateway_verifies_without_a_word(install: Install, root: Path, router: Path) -> None:
    install("--station", STATION, "--gateway", router)
    shutil.copytree(TARGETS, root / "usr/lib/systemd/system", symlinks=True)
    done = analyze("verify", f"--root={root}", "ghest-rt-gateway.service")
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


def test_it_reaches_every_station_that_is_installed(install: Install, root: Path, router: Path, tmp_path: Path) -> None:
    install("--station", STATION, "--name", "bed-1", "--gateway", router)
    assert "--station tcp/127.0.0.1:7447\n" in (root / UNIT).read_text()
    install("--station", other_station(tmp_path / "other"), "--name", "bed-2")
    unit = (root / UNIT).read_text()
    assert "--station tcp/127.0.0.1:7447" in unit and "--station tcp/127.0.0.1:7448" in unit
    assert install("--uninstall", "--name", "bed-1").returncode == 0
    assert (root / UNIT).is_file() and (root / IDENTITY / "key.pem").is_file()
    assert install("--uninstall", "--name", "bed-2").returncode == 0
    assert files_in(root) == set()


def test_a_new_access_list_replaces_one_copied_by_hand(
    install: Install, root: Path, router: Path, authority: Authority
) -> None:
    install("--station", STATION, "--gateway", router)
    (root / IDENTITY / "access.json").write_text("{}")
    authority.issue(Role.OPERATOR, "bench-1", [], 10)
    assert install("--gateway", router).returncode == 0
    assert "operator.bench-1" in (root / IDENTITY / "access.json").read_text()


def test_a_key_of_somebody_else_is_not_overwritten(install: Install, root: Path, router: Path) -> None:
    key = root / IDENTITY / "key.pem"
    key.parent.mkdir(parents=True)
    key.write_text("theirs")
    done = install("--station", STATION, "--gateway", router)
    assert done.returncode == 2
    assert str(key) in done.stderr
    assert key.read_text() == "theirs"


def test_a_station_with_its_identity_beside_it_is_pointed_to_the_gateway(install: Install, root: Path, tmp_path: Path) -> None:
    other = other_station(tmp_path / "other")
    other.write_text(other.read_text().replace("[publisher]", '[publisher]\nidentity = "station.bed-2"'))
    done = install("--station", other)
    assert done.returncode == 2
    assert "--gateway" in done.stderr
    assert files_in(root) == set()


def test_an_identity_that_nobody_connects_to_is_refused(install: Install, root: Path, authority: Authority) -> None:
    therapy = authority.issue(Role.THERAPY, "game-1", [], 10)
    done = install("--station", STATION, "--gateway", therapy)
    assert done.returncode == 2
    assert "--role router" in done.stderr
    assert files_in(root) == set()


def test_a_station_that_no_gateway_can_reach_is_refused(install: Install, root: Path, router: Path, tmp_path: Path) -> None:
    other = other_station(tmp_path / "other")
    other.write_text(other.read_text().replace("[publisher]", "[publisher]\nenabled = false"))
    done = install("--station", other, "--gateway", router)
    assert done.returncode == 2
    assert "no station listens" in done.stderr
    assert files_in(root) == set()
