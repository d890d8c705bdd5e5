"""The C++ example, built and run against a network that fails; skipped where its libraries are not installed."""

import os
import shutil
import subprocess
import threading
from pathlib import Path

import pytest

from tests.client.fakes import FakeStation, Network, wait

SOURCE = Path(__file__).parents[2] / "docs" / "examples" / "cpp"


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    for tool in ("cmake", "c++", "quicktype"):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not installed")
    folder = tmp_path_factory.mktemp("cpp")
    configured = subprocess.run(["cmake", "-B", folder, "-S", SOURCE], capture_output=True, text=True, check=False)
    if configured.returncode:
        if "find_package" in configured.stderr:
            pytest.skip("zenoh-cpp or nlohmann_json is not installed (CMAKE_PREFIX_PATH says where)")
        pytest.fail(configured.stderr)
    built = subprocess.run(["cmake", "--build", folder], capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    return folder / "listen"


class Listening:
    """The program running; its lines as they come."""

    def __init__(self, program: Path, endpoint: str) -> None:
        self.process = subprocess.Popen([program, endpoint, "one"], stdout=subprocess.PIPE, text=True, env=os.environ)
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join()

    def _read(self) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as lines:
            for line in lines:
                self.lines.append(line)

    def seqs(self) -> list[int]:
        return [int(line.split()[0]) for line in self.lines if "no angles: m0_not_seen" in line and "the last one" not in line]


def test_it_shows_every_sample_though_the_network_breaks_and_nothing_old(program: Path) -> None:
    with FakeStation() as station, Network(station.endpoint) as network:
        listening = Listening(program, network.endpoint)
        try:
            station.publish_until(lambda: len(listening.seqs()) > 20)
            wait(lambda: any("nothing new" in line for line in listening.lines))
            network.cut()
            station.publish(30)
            network.mend()
            station.publish_until(lambda: len(listening.seqs()) > 70, timeout_s=20.0)
            seqs = listening.seqs()
            assert seqs == list(range(seqs[0], seqs[-1] + 1))
            assert any("asked for again" in line for line in listening.lines)
        finally:
            listening.close()
