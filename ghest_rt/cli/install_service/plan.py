"""Which files and commands make a service of a station, and which undo it."""

import re
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from ghest_drivers.installing import pip_install
from ghest_rt.cli.install_service.cpus import check_cpus
from ghest_rt.cli.install_service.gateway import GATEWAY_UNIT, IDENTITY_DIR, KEY_PATH, gateway_unit, identity_files
from ghest_rt.cli.install_service.record import RECORD, Installed, InstalledService, read_record, sha256
from ghest_rt.cli.install_service.station_files import STATION_FILE, accept, clash, leaves_machine, station_files
from ghest_rt.cli.install_service.steps import RemoveFile, RunCommand, Step, WriteFile
from ghest_rt.config.load import load_station
from ghest_rt.errors import BadInputError

_SYSTEM = "etc/systemd/system"
_NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")
_EXECUTABLE = re.compile(r"^/[A-Za-z0-9._/+-]+$")
_SHIPPED_EXECUTABLE = "/opt/ghest-rt/bin/ghest-rt"
_HIDDEN = tuple(map(PurePosixPath, ("/home", "/root", "/run/user", "/tmp", "/var/tmp")))  # noqa: S108  (not used, refused)
_BACKOFF_SINCE = 254  # RestartSteps=, RestartMaxDelaySec=
_SHARED = {
    "70-ghest-rt.rules": "etc/udev/rules.d/70-ghest-rt.rules",
    "ghest-rt.sysusers.conf": "etc/sysusers.d/ghest-rt.conf",
    "ghest-rt.tmpfiles.conf": "etc/tmpfiles.d/ghest-rt.conf",
}


@dataclass(frozen=True, slots=True)
class Target:
    """Where to install.

    Attributes:
        root: "/", or a folder that stands for it: then nothing is started.
        name: Of the station among several on this machine; None for a single one.
    """

    root: Path
    name: str | None

    def __post_init__(self) -> None:
        if self.name is not None and not _NAME.fullmatch(self.name):
            raise BadInputError(f"--name {self.name!r}: 1 to 64 letters, digits, - and _")

    @property
    def live(self) -> bool:
        """Whether this is the running system."""
        return self.root == Path("/")

    @property
    def unit(self) -> str:
        """The unit's name."""
        return "ghest-rt.service" if self.name is None else f"ghest-rt@{self.name}.service"

    @property
    def config_dir(self) -> str:
        """Folder of the station file under the root."""
        return "etc/ghest-rt" if self.name is None else f"etc/ghest-rt/{self.name}"

    def systemctl(self, *arguments: str) -> tuple[str, ...]:
        """Return a call of systemctl for this system."""
        return ("systemctl", *(() if self.live else (f"--root={self.root}",)), *arguments)

    def tool(self, name: str, *arguments: str) -> tuple[str, ...]:
        """Return a call of another of systemd's programs for this system."""
        return (name, *(() if self.live else (f"--root={self.root}",)), *arguments)


@dataclass(slots=True)
class Plan:
    """What is to be done.

    Attributes:
        steps: In order.
        notes: What the user should know.
        obstacle: Why it must not be done as it is; "" if it may.
    """

    steps: list[Step] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    obstacle: str = ""


def plan_install(
    target: Target,
    *,
    shipped: Path,
    executable: Path,
    station: Path | None,
    cpus: str | None,
    systemd_version: int,
    gateway: Path | None = None,
) -> Plan:
    """Plan an installation or its renewal.

    Args:
        target: Where to.
        shipped: Folder with the project's units and rules.
        executable: The program that the unit starts.
        station: Station file to install; None to keep the one installed.
        cpus: CPUs for the service, like "2-3"; None for all.
        systemd_version: Decides on settings that older ones do not know.
        gateway: Folder of the identity of a gateway to install; None to keep what there is.

    Raises:
        BadInputError: Something given cannot be used, or a file to be replaced was changed by somebody else.
    """
    installed = read_record(target.root)
    plan = Plan(obstacle=_out_of_sight(executable))
    files = _system_files(target, shipped, executable, cpus, systemd_version)
    others = [
        (unit, target.root / one.station)
        for unit, one in installed.services.items()
        if one.station is not None and unit != target.unit
    ]
    before = installed.services.get(target.unit)
    station_path = f"{target.config_dir}/{STATION_FILE}"
    if station is not None:
        config, contents = station_files(station, here=target.live)
        clash(config, [(unit, path) for unit, path in others if path.exists()])
        files.update({f"{target.config_dir}/{name}": data for name, data in contents.items()})
        kept: dict[str, str] = {}
    elif before is not None and (target.root / station_path).exists():
        kept_station = load_station(target.root / station_path)
        accept(kept_station, here=target.live)
        config = kept_station.config
        kept = {path: digest for path, digest in before.files.items() if path.startswith(f"{target.config_dir}/")}
    else:
        raise BadInputError(f"no station file is installed for {target.unit}: name one with --station FILE")
    _refuse_foreign(target.root, files, installed)
    obsolete = _obsolete(target, installed, before, {*files, *kept})
    recorded = {**{path: sha256(data) for path, data in files.items()}, **kept}
    services = {**installed.services, target.unit: InstalledService(files=recorded, station=station_path)}
    if gateway is not None or GATEWAY_UNIT in installed.services:
        reached = [station or target.root / station_path, *(path for _, path in others if path.exists())]
        own, services[GATEWAY_UNIT] = _gateway(
            target, installed, shipped=shipped, executable=executable, identity=gateway, stations=reached
        )
        files.update(own)
    record = Installed(services=services).model_dump_json(indent=2).encode()
    plan.steps += [WriteFile(target.root / RECORD, record)]  # first: whatever follows can be undone
    plan.steps += [
        WriteFile(target.root / path, data, 0o600 if path == KEY_PATH else 0o644)
        for path, data in files.items()
        if _differs(target.root / path, data)
    ]
    plan.steps += obsolete
    plan.steps += _activation(target, (target.unit, *([GATEWAY_UNIT] if GATEWAY_UNIT in services else [])))
    if beyond := leaves_machine(config):
        plan.notes.append(f"the unit lets nothing leave this machine; for {', '.join(beyond)} see docs/systemd.md, Network")
    return plan


def plan_uninstall(target: Target) -> Plan:
    """Plan to undo an installation: files changed since then are kept, and so are recordings and the user.

    Raises:
        BadInputError: This service is not installed.
    """
    installed = read_record(target.root)
    service = installed.services.get(target.unit)
    if service is None:
        names = ", ".join(installed.services) or "none"
        raise BadInputError(f"{target.unit} is not installed by this command; installed: {names}")
    plan = Plan()
    left = {unit: one for unit, one in installed.services.items() if unit != target.unit}
    ended = {target.unit: service}
    if set(left) == {GATEWAY_UNIT}:  # a gateway to nothing
        ended[GATEWAY_UNIT] = left.pop(GATEWAY_UNIT)
    plan.steps.append(RunCommand(target.systemctl("disable", *(("--now",) if target.live else ()), *ended), may_fail=True))
    for path, digest in ((path, digest) for one in ended.values() for path, digest in one.files.items()):
        if any(path in one.files for one in left.values()) or not (target.root / path).exists():
            continue
        if sha256((target.root / path).read_bytes()) == digest:
            plan.steps.append(RemoveFile(target.root / path, _kept_folder(target.root, path)))
        else:
            plan.notes.append(f"kept, because it was changed since: {target.root / path}")
    record = target.root / RECORD
    if left:
        plan.steps.append(WriteFile(record, Installed(services=left).model_dump_json(indent=2).encode()))
    else:
        plan.steps.append(RemoveFile(record, target.root / "etc"))
    if target.live:
        plan.steps += [
            RunCommand(("systemctl", "daemon-reload")),
            RunCommand(("udevadm", "control", "--reload"), may_fail=True),
        ]
    if not left:
        plan.notes.append("kept: recordings in /var/lib/ghest-rt and the user ghest-rt (userdel ghest-rt)")
    return plan


def _system_files(target: Target, shipped: Path, executable: Path, cpus: str | None, systemd_version: int) -> dict[str, bytes]:
    _check_executable(executable, target.live)
    template = "ghest-rt.service" if target.name is None else "ghest-rt@.service"
    unit = (shipped / template).read_text(encoding="utf-8").replace(_SHIPPED_EXECUTABLE, str(executable))
    files = {place: (shipped / name).read_bytes() for name, place in _SHARED.items()}
    files[f"{_SYSTEM}/{template}"] = unit.encode()
    drop_ins = f"{_SYSTEM}/{target.unit}.d"
    if systemd_version >= _BACKOFF_SINCE:
        files[f"{drop_ins}/10-backoff.conf"] = (shipped / "ghest-rt-backoff.conf").read_bytes()
    if cpus is not None:
        check_cpus(cpus, must_exist=target.live)
        files[f"{drop_ins}/20-cpus.conf"] = f"# The service's threads run here only.\n[Service]\nCPUAffinity={cpus}\n".encode()
    return files


def _check_executable(executable: Path, must_exist: bool) -> None:
    if not _EXECUTABLE.match(str(executable)):
        raise BadInputError(f"--executable {executable}: an absolute path of letters, digits and . _ / + -")
    if must_exist and not executable.is_file():
        raise BadInputError(f"{executable} is not there; name the program with --executable FILE")


def _out_of_sight(executable: Path) -> str:
    """Return why the service's user could not start the program, or ""."""
    interpreter = (executable.parent / "python3").resolve()
    for path in (executable, interpreter):
        if any(PurePosixPath(path).is_relative_to(hidden) for hidden in _HIDDEN):
            return (
                f"{path}: the service's user cannot see this folder. Install ghest-rt where it can: "
                f"python3 -m venv /opt/ghest-rt && /opt/ghest-rt/bin/{pip_install(elsewhere=True)}, "
                "then run /opt/ghest-rt/bin/ghest-rt install-service"
            )
    return ""


def _gateway(
    target: Target, installed: Installed, *, shipped: Path, executable: Path, identity: Path | None, stations: list[Path]
) -> tuple[dict[str, bytes], InstalledService]:
    """Return the gateway's files that are to be written, and its record; without an identity the installed one is kept."""
    template = (shipped / GATEWAY_UNIT).read_text(encoding="utf-8").replace(_SHIPPED_EXECUTABLE, str(executable))
    unit = {f"{_SYSTEM}/{GATEWAY_UNIT}": gateway_unit(template, stations)}
    before = installed.services.get(GATEWAY_UNIT, InstalledService(files={}))
    kept = {path: digest for path, digest in before.files.items() if path.startswith(f"{IDENTITY_DIR}/")}
    files = unit if identity is None else {**unit, **identity_files(identity)}
    # A new access list is copied over the old one by hand, too: once the folder is ours, whatever is in it is replaced.
    _refuse_foreign(target.root, unit if kept else files, installed)
    return files, InstalledService(files={**kept, **{path: sha256(data) for path, data in files.items()}})


def _activation(target: Target, units: tuple[str, ...]) -> list[Step]:
    steps: list[Step] = [
        RunCommand(target.tool("systemd-sysusers", "ghest-rt.conf")),
        RunCommand(target.tool("systemd-tmpfiles", "--create", "ghest-rt.conf")),
    ]
    if not target.live:
        return [*steps, RunCommand(target.systemctl("enable", *units))]
    subsystems = (f"--subsystem-match={name}" for name in ("usb", "usb-serial", "tty"))
    return [
        *steps,
        RunCommand(("udevadm", "control", "--reload"), may_fail=True),
        RunCommand(("udevadm", "trigger", "--action=change", *subsystems), may_fail=True),
        RunCommand(("systemctl", "daemon-reload")),
        RunCommand(("systemctl", "enable", *units)),
        RunCommand(("systemctl", "restart", *units)),
    ]


def _refuse_foreign(root: Path, files: dict[str, bytes], installed: Installed) -> None:
    for path, data in files.items():
        place = root / path
        if place.exists() and _differs(place, data) and sha256(place.read_bytes()) not in installed.known_sha256(path):
            keep = ", or leave --station out to keep it" if path.endswith(STATION_FILE) else ""
            raise BadInputError(f"{place} was not written by this command, or was changed since: move it away first{keep}")


def _obsolete(target: Target, installed: Installed, before: InstalledService | None, wanted: set[str]) -> list[Step]:
    if before is None:
        return []
    return [
        RemoveFile(target.root / path, _kept_folder(target.root, path))
        for path, digest in before.files.items()
        if path not in wanted
        and not installed.shared(path, target.unit)
        and (target.root / path).exists()
        and sha256((target.root / path).read_bytes()) == digest
    ]


def _kept_folder(root: Path, path: str) -> Path:
    """Return the folder that stays even if nothing is left in it: a folder of the system."""
    for folder in (_SYSTEM, "etc/udev/rules.d", "etc/sysusers.d", "etc/tmpfiles.d"):
        if path.startswith(f"{folder}/"):
            return root / folder
    return root / "etc"


def _differs(path: Path, data: bytes) -> bool:
    return not path.exists() or path.read_bytes() != data
