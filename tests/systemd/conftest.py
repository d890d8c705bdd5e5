"""A folder that stands for a system, and the command that installs into it."""

import io
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from ghest_rt.cli.main import main

PROJECT = Path(__file__).resolve().parents[2]
UNITS = PROJECT / "systemd"
STATION = PROJECT / "config" / "station-sim.toml"
PROGRAM = "/opt/ghest-rt/bin/ghest-rt"

Install = Callable[..., "subprocess.CompletedProcess[str]"]

needs_systemd = pytest.mark.skipif(
    not all(map(shutil.which, ("systemctl", "systemd-analyze", "systemd-sysusers", "systemd-tmpfiles"))),
    reason="systemd's programs are not installed (apt install systemd udev)",
)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A system with systemd's own targets and a program to start."""
    folder = tmp_path / "root"
    program = folder / PROGRAM.removeprefix("/")
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    return folder


@pytest.fixture
def install(root: Path, monkeypatch: pytest.MonkeyPatch) -> Install:
    """Run `ghest-rt install-service` on that system."""
    monkeypatch.setattr("ghest_rt.cli.console.set_up_logging", lambda verbose: None)

    def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
        command = ["ghest-rt", "install-service", "--root", str(root), "--executable", PROGRAM, *map(str, arguments)]
        monkeypatch.setattr(sys, "argv", command)
        stdout, stderr = io.StringIO(), io.StringIO()
        with redirect_stdout(stdout), redirect_stderr(stderr), pytest.raises(SystemExit) as end:
            main()
        return subprocess.CompletedProcess(command, int(end.value.code or 0), stdout.getvalue(), stderr.getvalue())

    return run
