"""Installation into a folder that stands for a system, by systemd's own programs."""

import os
import stat
from pathlib import Path

import pytest

from ghest_rt.cli.install_service.plan import Target, plan_install
from ghest_rt.cli.install_service.steps import shown
from ghest_rt.config.shipped import shipped_systemd_dir
from ghest_rt.errors import BadInputError
from tests.systemd.conftest import PROGRAM, STATION, UNITS, Install, needs_systemd
from tests.systemd.system import files_in, other_station

pytestmark = needs_systemd


def test_the_dry_run_shows_every_step_and_does_none(install: Install, root: Path) -> None:
    before = sorted(root.rglob("*"))
    dry = install("--station", STATION, "--dry-run")
    assert dry.returncode == 0, dry.stderr
    assert sorted(root.rglob("*")) == before
    done = install("--station", STATION)
    assert done.returncode == 0, done.stderr
    assert [line.removeprefix("would ") for line in dry.stdout.splitlines()] == done.stdout.splitlines()


def test_what_is_installed(install: Install, root: Path) -> None:
    assert install("--station", STATION, "--cpus", "2-3").returncode == 0
    unit = (root / "etc/systemd/system/ghest-rt.service").read_text()
    assert f"ExecStart={PROGRAM} run --station /etc/ghest-rt/station.toml" in unit
    assert "CPUAffinity=2-3" in (root / "etc/systemd/system/ghest-rt.service.d/20-cpus.conf").read_text()
    assert (root / "etc/ghest-rt/station.toml").read_bytes() == STATION.read_bytes()
    assert (root / "etc/ghest-rt/armeo_spring.urdf").is_file()
    assert (root / "etc/udev/rules.d/70-ghest-rt.rules").is_file()
    assert (root / "etc/systemd/system/multi-user.target.wants/ghest-rt.service").readlink().name == "ghest-rt.service"


@pytest.mark.skipif(os.geteuid() != 0, reason="users and owners need root")
def test_the_service_has_a_user_of_its_own_who_alone_reads_recordings(install: Install, root: Path) -> None:
    assert install("--station", STATION).returncode == 0
    (user,) = (line.split(":") for line in (root / "etc/passwd").read_text().splitlines() if line.startswith("ghest-rt:"))
    assert user[6].endswith("nologin")
    groups = dict(line.split(":")[::3] for line in (root / "etc/group").read_text().splitlines())
    assert groups["dialout"] == groups["video"] == "ghest-rt"
    recordings = (root / "var/lib/ghest-rt").stat()
    assert (recordings.st_uid, stat.S_IMODE(recordings.st_mode)) == (int(user[2]), 0o750)
    config = (root / "etc/ghest-rt").stat()
    assert (config.st_uid, config.st_gid, stat.S_IMODE(config.st_mode)) == (0, int(user[3]), 0o750)


def test_uninstalling_leaves_nothing_of_it(install: Install, root: Path) -> None:
    before = files_in(root)
    assert install("--station", STATION, "--cpus", "0").returncode == 0
    assert files_in(root) > before
    done = install("--uninstall")
    assert done.returncode == 0, done.stderr
    assert files_in(root) == before
    assert "recordings" in done.stdout
    assert install("--uninstall").returncode == 2


def test_a_file_that_was_changed_is_kept_and_never_overwritten(install: Install, root: Path) -> None:
    install("--station", STATION)
    station = root / "etc/ghest-rt/station.toml"
    station.write_text(station.read_text() + "\n# ours\n")
    refused = install("--station", STATION)
    assert refused.returncode == 2
    assert "changed since" in refused.stderr
    assert install().returncode == 0  # renewed around it
    assert "# ours" in station.read_text()
    done = install("--uninstall")
    assert f"kept, because it was changed since: {station}" in done.stdout
    assert station.is_file()


def test_a_renewal_replaces_what_an_older_version_wrote(install: Install, root: Path) -> None:
    install("--station", STATION, "--cpus", "0")
    assert install("--cpus", "1").returncode == 0
    assert "CPUAffinity=1" in (root / "etc/systemd/system/ghest-rt.service.d/20-cpus.conf").read_text()
    assert install().returncode == 0
    assert not (root / "etc/systemd/system/ghest-rt.service.d").exists()


def test_two_stations_share_what_they_share(install: Install, root: Path, tmp_path: Path) -> None:
    other = other_station(tmp_path / "other")
    assert install("--station", STATION, "--name", "bed-1").returncode == 0
    assert install("--station", other, "--name", "bed-2").returncode == 0
    assert (root / "etc/ghest-rt/bed-2/station.toml").read_text() == other.read_text()
    assert install("--uninstall", "--name", "bed-1").returncode == 0
    wants = root / "etc/systemd/system/multi-user.target.wants"
    assert [path.name for path in wants.iterdir()] == ["ghest-rt@bed-2.service"]
    assert (root / "etc/systemd/system/ghest-rt@.service").is_file()
    assert (root / "etc/udev/rules.d/70-ghest-rt.rules").is_file()
    assert not (root / "etc/ghest-rt/bed-1").exists()
    assert install("--uninstall", "--name", "bed-2").returncode == 0
    assert files_in(root) == set()


@pytest.mark.parametrize(
    ("station_id", "says"),
    [("sim", "station.id"), ("else", "another port")],
)
def test_stations_in_each_others_way_are_refused(
    install: Install, root: Path, tmp_path: Path, station_id: str, says: str
) -> None:
    install("--station", STATION)
    other = other_station(tmp_path / "other")
    other.write_text(STATION.read_text().replace('id = "sim"', f'id = "{station_id}"'))
    before = files_in(root)
    done = install("--station", other, "--name", "second")
    assert done.returncode == 2
    assert says in done.stderr
    assert files_in(root) == before


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--name", "../x"], "--name"),
        (["--cpus", "2\nUser=root"], "--cpus"),
        (["--executable", "/opt/a b/ghest-rt"], "--executable"),
        (["--executable", "/home/me/venv/bin/ghest-rt"], "cannot see"),
        (["--executable", "bin/ghest-rt"], "--executable"),
    ],
)
def test_what_cannot_be_used_is_refused_and_nothing_is_written(
    install: Install, root: Path, arguments: list[str], says: str
) -> None:
    done = install("--station", STATION, *arguments)
    assert done.returncode == 2
    assert says in done.stderr
    assert files_in(root) == set()


def test_a_program_that_the_services_user_cannot_see_is_a_warning_of_the_dry_run(install: Install, root: Path) -> None:
    shown = install("--station", STATION, "--executable", "/home/me/venv/bin/ghest-rt", "--dry-run")
    assert shown.returncode == 0
    assert "would write" in shown.stdout
    assert "warning" in shown.stderr and "cannot see this folder" in shown.stderr
    assert files_in(root) == set()


@pytest.mark.parametrize("urdf", ["../armeo_spring.urdf", "station.toml"])
def test_a_station_reaching_out_of_its_folder_is_refused(install: Install, root: Path, tmp_path: Path, urdf: str) -> None:
    other = other_station(tmp_path / "other")
    (tmp_path / "armeo_spring.urdf").write_bytes((other.parent / "armeo_spring.urdf").read_bytes())
    other.write_text(other.read_text().replace('urdf = "armeo_spring.urdf"', f'urdf = "{urdf}"'))
    done = install("--station", other)
    assert done.returncode == 2
    assert "exoskeleton.urdf" in done.stderr
    assert files_in(root) == set()


def test_a_network_endpoint_is_pointed_out(install: Install, tmp_path: Path) -> None:
    other = other_station(tmp_path / "other")
    other.write_text(other.read_text().replace("tcp/127.0.0.1:7448", "tls/10.0.0.5:7447"))
    assert "tls/10.0.0.5:7447" in install("--station", other).stdout


def test_on_the_running_system_it_is_started_and_udev_reads_its_rules_again(tmp_path: Path) -> None:
    steps = plan(Target(Path("/"), None), 252)
    assert steps[-1] == "run systemctl restart ghest-rt.service"
    assert "run systemctl daemon-reload" in steps
    assert "run udevadm control --reload" in steps
    assert not any("backoff" in step for step in steps)


def test_growing_pauses_where_systemd_knows_them(tmp_path: Path) -> None:
    steps = plan(Target(tmp_path, None), 254)
    assert f"write {tmp_path}/etc/systemd/system/ghest-rt.service.d/10-backoff.conf" in steps


def test_cpus_that_the_machine_lacks_are_refused_but_in_an_image(tmp_path: Path) -> None:
    for cpus in ("0", "0-0,0"):
        assert plan(Target(Path("/"), None), 252, cpus)
    for cpus in ("4000", "0-4000", "0,4000", "3-2"):
        with pytest.raises(BadInputError, match=f"--cpus '?{cpus}"):
            plan(Target(Path("/"), None), 252, cpus)
    assert plan(Target(tmp_path, None), 252, "4000")


def test_a_station_that_the_service_would_refuse_is_not_installed(install: Install, root: Path, tmp_path: Path) -> None:
    other = other_station(tmp_path / "other")
    other.write_text(other.read_text().replace('link = "l8"', 'link = "l99"', 1))
    for arguments in ([], ["--dry-run"]):
        done = install("--station", other, *arguments)
        assert done.returncode == 2
        assert "cameras.r1.link = 'l99'" in done.stderr
    assert files_in(root) == set()


def plan(target: Target, systemd_version: int, cpus: str | None = None) -> list[str]:
    made = plan_install(
        target, shipped=UNITS, executable=Path("/bin/sh"), station=STATION, cpus=cpus, systemd_version=systemd_version
    )
    return shown(made.steps)


def test_a_missing_program_is_refused() -> None:
    with pytest.raises(BadInputError, match="is not there"):
        plan_install(
            Target(Path("/"), None),
            shipped=shipped_systemd_dir(),
            executable=Path(PROGRAM),
            station=STATION,
            cpus=None,
            systemd_version=252,
        )
