"""`ghest-rt listen` tells on standard error what is not a sample."""

import json
import subprocess
from pathlib import Path

from tests.client.fakes import FakeStation, Network
from tests.program import COMMAND

LISTEN = (*COMMAND, "listen")


def test_it_prints_samples_as_json_lines_and_says_what_happened_beside_them(tmp_path: Path) -> None:
    out = tmp_path / "samples.jsonl"
    with FakeStation("one") as one, Network(one.endpoint) as network, out.open("w") as file:
        listening = subprocess.Popen(
            [*LISTEN, "--connect", network.endpoint, "--station", "one", "--count", "150", "--json"],
            stdout=file,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert listening.stderr is not None
        before = list(iter(listening.stderr.readline, f"connected to {network.endpoint}\n"))
        assert "".join(before) in ("", "one: lost: no connection\n")
        one.publish(60, period_s=0.015)
        network.cut()
        one.publish(40)
        network.mend()
        one.publish_until(lambda: listening.poll() is not None)
        _, stderr = listening.communicate(timeout=10)
    seqs = [json.loads(line)["seq"] for line in out.read_text().splitlines()]
    assert seqs == list(range(seqs[0], seqs[0] + 150))
    assert "one: live" in stderr
    assert "not connected to" in stderr
    assert "150 samples received, 0 lost" in stderr


def test_a_station_that_is_not_there_is_told_with_those_that_are() -> None:
    with FakeStation("one") as one:
        command = [*LISTEN, "--connect", one.endpoint, "--station", "nosuch"]
        with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as listening:
            assert listening.stderr is not None
            told = next(line for line in listening.stderr if "alive" in line or "is a ghest-rt running" in line)
            listening.terminate()
            listening.communicate(timeout=10)
    assert told == f"no station nosuch at {one.endpoint}; alive: one\n"


def test_an_identity_that_is_none_is_bad_input(tmp_path: Path) -> None:
    done = subprocess.run(
        [*LISTEN, "--connect", "tls/127.0.0.1:7447", "--identity", str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert "no identity here" in done.stderr
