"""The gateway's unit, as systemd judges it, and the gateway under its restrictions."""

import ctypes.util
import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from ghest_rt.security.identity_check import load_identity
from ghest_rt.security.session import open_session
from tests.security.clinic import Clinic
from tests.systemd.conftest import PROJECT, UNITS, needs_systemd

pytestmark = needs_systemd
UNIT = UNITS / "ghest-rt-gateway.service"
CONFINED = PROJECT / "tests" / "systemd" / "confined.py"


def test_systemd_has_nothing_to_say(tmp_path: Path) -> None:
    unit = tmp_path / UNIT.name
    unit.write_text(UNIT.read_text().replace("/opt/ghest-rt/bin/ghest-rt", "/bin/true"))
    verified = subprocess.run(["systemd-analyze", "verify", unit], capture_output=True, text=True, timeout=60, check=False)
    assert (verified.returncode, verified.stdout + verified.stderr) == (0, "")
    judged = subprocess.run(
        ["systemd-analyze", "security", "--offline=true", unit], capture_output=True, text=True, timeout=60, check=False
    )
    figure = re.search(r"Overall exposure level for \S+: (\d+\.\d)", judged.stdout)
    assert figure is not None
    assert float(figure[1]) <= 1.5


@pytest.mark.skipif(ctypes.util.find_library("seccomp") is None, reason="libseccomp is not installed")
def test_it_passes_samples_on_under_confinement(clinic: Clinic) -> None:
    station, (inside,) = open_session(("tcp/127.0.0.1:0",))
    command = [sys.executable, str(CONFINED), str(UNIT), "gateway", "--identity", str(clinic.router)]
    with (
        station,
        subprocess.Popen(
            [*command, "--listen", "tls/127.0.0.1:0", "--station", inside], stdout=subprocess.PIPE, text=True
        ) as process,
    ):
        assert process.stdout is not None
        try:
            outside = process.stdout.readline().split()[0]
            got = threading.Event()
            therapy, _ = open_session((), (outside,), load_identity(clinic.therapy), "client")
            with therapy, therapy.declare_subscriber("ghest/*/gh/angles", lambda _: got.set()):
                for _ in range(200):
                    station.put("ghest/sim/gh/angles", b"{}")
                    if got.wait(0.02):
                        break
            assert got.is_set()
        finally:
            process.terminate()
