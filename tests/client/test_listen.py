"""`ghest-rt listen` tells on standard error what is not a sample."""

import json
import subprocess
import sys

from tests.client.fakes import FakeStation, Network
from tests.client.processes import free_endpoint

COMMAND = (sys.executable, "-m", "ghest_rt.cli.main", "listen")


def test_it_prints_samples_as_json_lines_and_says_what_happened_beside_them() -> None:
    with FakeStation("one") as one, FakeStation("two", endpoint=free_endpoint()) as two, Network(one.endpoint) as network:
        two.publish(2)
        listening = subprocess.Popen(
            [*COMMAND, "--connect", network.endpoint, "--station", "one", "--count", "150", "--json"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert listening.stderr is not None
        assert "connected to" in listening.stderr.readline()
        one.publish(60, period_s=0.015)
        network.cut()
        one.publish(40)
        network.mend()
        one.publish_until(lambda: listening.poll() is not None)
        stdout, stderr = listening.communicate(timeout=10)
    seqs = [json.loads(line)["seq"] for line in stdout.splitlines()]
    assert seqs == list(range(seqs[0], seqs[0] + 150))
    assert "one: live" in stderr
    assert "not connected to" in stderr
    assert "150 samples received, 0 lost" in stderr


def test_an_identity_that_is_none_is_bad_input(tmp_path: object) -> None:
    done = subprocess.run(
        [*COMMAND, "--connect", "tls/127.0.0.1:7447", "--identity", str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "ca.pem" in done.stderr
