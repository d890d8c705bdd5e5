"""The service does its work under the unit's restrictions, applied to a real process."""

import ctypes.util
import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.systemd.conftest import PROJECT, UNITS, needs_systemd

pytestmark = [
    needs_systemd,
    pytest.mark.skipif(ctypes.util.find_library("seccomp") is None, reason="libseccomp is not installed"),
]
SCRIPT = Path(__file__).with_name("confined.py")


def confined(*arguments: object) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, SCRIPT, UNITS / "ghest-rt.service", *arguments]
    return subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=60, check=False)


def test_the_confinement_refuses_what_it_should_and_lets_devices_and_libraries_be() -> None:
    done = confined("probe")
    assert done.returncode == 0, done.stderr
    answers = json.loads(done.stdout.splitlines()[-1])
    assert answers.pop("chroot") == answers.pop("packet") == "refused 1"
    answers.pop("w^x")  # an old kernel lets it pass
    assert set(answers.values()) == {"done"}, answers


def test_the_service_measures_under_confinement() -> None:
    done = confined("--replay", PROJECT / "sim_fixtures" / "SFE.mcap", "--listen", "tcp/127.0.0.1:0", "--json")
    assert done.returncode == 0, done.stderr
    (run,) = json.loads(done.stdout)["runs"]
    assert run["samples"] > 300
    assert run["valid_fraction"] + run["degraded_fraction"] > 0.95  # degraded: bridged, on a busy machine
