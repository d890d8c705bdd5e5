"""`ghest-rt install-service`: show what will be done, do it, undo it."""

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from ghest_rt.cli.install_service.plan import Plan, Target, plan_install, plan_uninstall
from ghest_rt.cli.install_service.steps import shown
from ghest_rt.config.shipped import shipped_systemd_dir
from ghest_rt.errors import BadInputError, GhestError


@dataclass(frozen=True, slots=True)
class InstallOptions:
    """What the command line asks for.

    Attributes:
        station: Station file to install; None keeps the installed one.
        name: Of the station among several; None for a single one.
        cpus: CPUs for the service; None for all.
        executable: Program for the unit; None for the one that is running.
        gateway: Folder of the identity for a gateway to be installed; None for none, or for the one there is.
        root: Folder that stands for "/".
        uninstall: Undo.
        dry_run: Only show.
    """

    station: Path | None
    name: str | None
    cpus: str | None
    executable: Path | None
    gateway: Path | None
    root: Path
    uninstall: bool
    dry_run: bool


def install_service(options: InstallOptions) -> None:
    """Install, renew or remove a service; every step is shown before it is done.

    Raises:
        GhestError: Something given cannot be used, or a step failed; what was done can be undone.
    """
    target = Target(options.root.resolve(), options.name)
    plan = plan_uninstall(target) if options.uninstall else _plan_install(target, options)
    console = Console(soft_wrap=True, highlight=False)
    if options.dry_run:
        for line in shown(plan.steps):
            console.print(f"would {line}", markup=False)
        _print_notes(console, plan)
        if plan.obstacle:
            sys.stderr.write(f"warning: as it is this would be refused: {plan.obstacle}\n")
        return
    if plan.obstacle:
        raise BadInputError(plan.obstacle)
    if target.live and os.geteuid() != 0:
        raise GhestError(
            "this changes the system: run it as root, sudo ghest-rt install-service …; --dry-run shows what it does"
        )
    for step in plan.steps:
        console.print(step.shown, markup=False)
        try:
            step.do()
        except GhestError as error:
            undo = "" if options.uninstall else "; what was done so far is undone by --uninstall"
            raise GhestError(f"{error}{undo}") from error
    _print_notes(console, plan)
    if not options.uninstall and target.live:
        console.print(f"see how it does: systemctl status {target.unit}; journalctl -u {target.unit} -f", markup=False)


def _plan_install(target: Target, options: InstallOptions) -> Plan:
    return plan_install(
        target,
        shipped=shipped_systemd_dir(),
        executable=options.executable or _running_program(),
        station=options.station,
        cpus=options.cpus,
        gateway=options.gateway,
        systemd_version=_systemd_version(),
    )


def _print_notes(console: Console, plan: Plan) -> None:
    for note in plan.notes:
        console.print(f"note: {note}", markup=False)


def _running_program() -> Path:
    program = Path(sys.prefix) / "bin" / "ghest-rt"
    if program.is_file():
        return program
    found = shutil.which("ghest-rt")
    if found is None:
        raise BadInputError("the program ghest-rt is not found; name it with --executable FILE")
    return Path(found)


def _systemd_version() -> int:
    """Return the major version of systemd.

    Raises:
        GhestError: It is not there.
    """
    try:
        command = (shutil.which("systemctl") or "systemctl", "--version")
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)  # noqa: S603
        return int(done.stdout.split()[1])
    except (OSError, IndexError, ValueError, subprocess.TimeoutExpired) as error:
        raise GhestError("systemctl does not answer: this machine does not run systemd") from error
