"""Bad input and a full standard output become one message and an exit code, never a traceback."""

from pathlib import Path
from subprocess import PIPE, run

import pytest

from ghest_rt.config.shipped import shipped_config_dir
from tests.cli.conftest import Run
from tests.program import COMMAND


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>'), "the axis is zero; give a direction"),
        (('<joint name="j1"', '<joint name="j0"'), "a second joint of this name; rename one"),
        (("<robot", "<!DOCTYPE robot><robot"), "may not declare a document type"),
        (("<link name", "<ling name"), "not well-formed XML"),
    ],
)
@pytest.mark.parametrize("command", ["simulate", "run"])
def test_a_simulated_station_has_its_urdf_read_as_strictly_as_a_real_one(
    ghest_rt: Run, tmp_path: Path, command: str, change: tuple[str, str], told: str
) -> None:
    urdf, station = tmp_path / "armeo_spring.urdf", tmp_path / "station.toml"
    text = (shipped_config_dir() / urdf.name).read_text(encoding="utf-8")
    assert change[0] in text
    urdf.write_text(text.replace(*change, 1), encoding="utf-8")
    station.write_text((shipped_config_dir() / "station-sim.toml").read_text(encoding="utf-8"), encoding="utf-8")
    more = ("--movement", "COMB", "--out", tmp_path / "a.mcap") if command == "simulate" else ("--no-publish",)
    done = ghest_rt(command, "--station", station, "--duration", "0.2", *more)
    assert done.returncode == 2
    assert told in done.stderr
    assert "armeo_spring.urdf" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("accuracy", "--quick", "--duration", "inf"), "--duration inf: give a number of seconds"),
        (("latency", "--quick", "--duration", "0.1", "--movement", "SFE"), "--duration 0.1: no speed comes to 10 samples"),
    ],
)
def test_a_duration_that_no_study_can_use_is_told(ghest_rt: Run, tmp_path: Path, words: tuple[str, ...], told: str) -> None:
    done = ghest_rt("study", *words, "--out", tmp_path)
    assert done.returncode == 2
    assert told in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ("schema",),
        ("--replay", "BLANK", "--no-publish", "--speed", "max", "--json"),
        ("estimate", "BLANK", "--out", "OUT.csv"),
        ("simulate", "--movement", "COMB", "--duration", "0.1", "--out", "OUT.mcap"),
        ("score", "OUT.mcap"),
    ],
)
def test_a_full_standard_output_is_told_once(words: tuple[str, ...], blank: Path, tmp_path: Path) -> None:
    if words[0] == "score":
        out = str(tmp_path / "OUT.mcap")
        run([*COMMAND, "simulate", "--movement", "SFE", "--duration", "0.2", "--out", out], check=True, timeout=60)
    arguments = [{"BLANK": str(blank)}.get(word, word.replace("OUT", str(tmp_path / "OUT"))) for word in words]
    with Path("/dev/full").open("w") as full:
        done = run([*COMMAND, *arguments], stdout=full, stderr=PIPE, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "ghest-rt: standard output: cannot be written to: No space left on device"
    assert "Traceback" not in done.stderr
