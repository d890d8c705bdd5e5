"""A service and its subscriber as two processes, and how the service ends."""

import json
import signal
import subprocess
from pathlib import Path

import pytest

from tests.cli.conftest import Run
from tests.endpoints import free_endpoint
from tests.program import COMMAND


def test_listen_in_another_process_gets_every_sample(ghest_rt: Run, blank: Path) -> None:
    endpoint = free_endpoint()
    service = subprocess.Popen(
        [*COMMAND, "--replay", blank, "--loop", "--listen", endpoint, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    try:
        heard = ghest_rt("listen", "--connect", endpoint, "--count", "60", "--json")
    finally:
        service.send_signal(signal.SIGTERM)
        stdout, stderr = service.communicate(timeout=20)
    assert heard.returncode == 0, heard.stderr
    messages = [json.loads(line) for line in heard.stdout.splitlines()]
    first = messages[0]["seq"]
    assert [message["seq"] for message in messages] == list(range(first, first + 60))  # across repetitions of the recording
    assert "60 samples received, 0 lost" in heard.stderr
    assert all(message["angles_deg"] is None for message in messages)  # the cameras see nothing
    assert service.returncode == 0, stderr
    assert json.loads(stdout)["runs"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("speed", ["1", "max"])
def test_a_signal_ends_the_service_with_its_summary_and_exit_code_0(blank: Path, number: signal.Signals, speed: str) -> None:
    service = subprocess.Popen(
        [*COMMAND, "--replay", blank, "--loop", "--no-publish", "--speed", speed, "--verbose"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert service.stderr is not None
    service.stderr.readline()  # it is running
    service.send_signal(number)
    stdout, stderr = service.communicate(timeout=20)
    assert service.returncode == 0, stderr
    assert "blank.mcap" in stdout
    assert "Traceback" not in stderr
