"""`ghest-rt run` with a station that cannot be: nothing is started."""

import json
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from ghest_rt.config.shipped import shipped_config_dir
from tests.cli.conftest import Run
from tests.program import COMMAND


def station(folder: Path, name: str, old: str = "", new: str = "") -> Path:
    shutil.copy(shipped_config_dir() / "armeo_spring.urdf", folder)
    text = (shipped_config_dir() / name).read_text()
    assert old in text
    path = folder / "station.toml"
    path.write_text(text.replace(old, new, 1))
    return path


@pytest.mark.parametrize("name", ["station-sim.toml", "station-sr300-serial.toml"])
@pytest.mark.parametrize("command", [("run",), ("record", "--out", "recordings")])
def test_a_station_whose_parts_do_not_fit_ends_with_2_before_anything_is_started(
    ghest_rt: Run, tmp_path: Path, name: str, command: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = station(tmp_path, name, 'link = "l8"', 'link = "l99"')
    begin_s = time.monotonic()
    done = ghest_rt(*command, "--station", path, "--duration", "30", "--listen", "tcp/127.0.0.1:0")
    assert done.returncode == 2
    assert time.monotonic() - begin_s < 20.0
    assert done.stderr.count("\n") == 1
    assert "cameras.r1.link = 'l99'" in done.stderr
    assert not (tmp_path / "recordings").exists()


def test_a_run_of_fixed_length_without_its_devices_ends_with_3(ghest_rt: Run, tmp_path: Path) -> None:
    path = station(tmp_path, "station-sr300-serial.toml", "/dev/ttyUSB0", "/dev/ttyNoSuchPort")
    done = ghest_rt("run", "--station", path, "--duration", "1", "--no-publish", "--json")
    assert done.returncode == 3
    assert json.loads(done.stdout)["runs"]  # what it came to is told all the same
    assert "delivered nothing in 1 s" in done.stderr
    assert f"ghest-rt doctor --station {path}" in done.stderr


def test_one_that_is_stopped_before_ends_with_0(tmp_path: Path) -> None:
    path = station(tmp_path, "station-sr300-serial.toml", "/dev/ttyUSB0", "/dev/ttyNoSuchPort")
    command = [*COMMAND, "run", "--station", path, "--duration", "60", "--no-publish"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as service:
        assert service.stderr is not None
        service.stderr.readline()  # it is running
        service.send_signal(signal.SIGTERM)
        assert service.wait(timeout=20) == 0
