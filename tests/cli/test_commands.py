"""The commands as a user runs them: exit codes, what stands on which stream, and messages that say what to do."""

import csv
import json
import socket
from pathlib import Path

import pytest

from ghest_rt.cli.table_file import COLUMNS
from tests.cli.conftest import Run
from tests.cli.recordings import write_blank_recording


def test_help_names_every_command_and_the_way_in(ghest_rt: Run) -> None:
    done = ghest_rt("--help")
    assert done.returncode == 0
    for word in ("--replay", "run", "simulate", "estimate", "score", "listen", "schema"):
        assert word in done.stdout


def test_help_imports_nothing_heavy(ghest_rt: Run) -> None:
    import subprocess
    import sys

    code = (
        "import sys, ghest_rt.cli.main; print([m for m in ('numpy', 'cv2', 'pydantic', 'zenoh', 'mcap') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_replay_json_is_one_document_on_standard_output(ghest_rt: Run, blank: Path) -> None:
    done = ghest_rt("--replay", blank, "--json", "--no-publish", "--method", "refined")
    assert done.returncode == 0, done.stderr
    (run,) = json.loads(done.stdout)["runs"]
    assert run["source"] == "blank.mcap"
    # On a busy machine ticks are missed, and frames passed over before the first that is used: the grid begins with that one.
    assert 20 - run["missed_ticks"] - run["skipped_frames"] <= run["samples"] - run["starting"] <= 20
    assert run["valid_fraction"] == 0.0
    assert "samples published" in done.stderr


def test_replay_at_full_speed_publishes_every_instant(ghest_rt: Run, blank: Path) -> None:
    done = ghest_rt("--replay", blank, "--speed", "max", "--json", "--listen", "tcp/127.0.0.1:0")
    assert done.returncode == 0, done.stderr
    (run,) = json.loads(done.stdout)["runs"]
    assert run["samples"] >= 20
    assert run["lateness"] is None


def test_replay_of_a_folder_plays_every_recording(ghest_rt: Run, blank: Path, tmp_path: Path) -> None:
    for name in ("b.mcap", "a.mcap"):
        (tmp_path / name).write_bytes(blank.read_bytes())
    done = ghest_rt("--replay", tmp_path, "--speed", "20", "--json", "--no-publish")
    assert done.returncode == 0, done.stderr
    assert [run["source"] for run in json.loads(done.stdout)["runs"]] == ["a.mcap", "b.mcap"]


def test_estimate_writes_the_same_bytes_twice(ghest_rt: Run, blank: Path, tmp_path: Path) -> None:
    for name in ("a.csv", "b.csv", "a.parquet", "b.parquet"):
        done = ghest_rt("estimate", blank, "--out", tmp_path / name, "--method", "paper")
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()
    with (tmp_path / "a.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert [int(row["seq"]) for row in rows] == list(range(len(rows)))
    assert rows[0]["status"] == "lost"
    assert rows[0]["flexion_deg"] == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.parquet", "b.csv", "b.parquet"]


def test_what_the_estimator_does_not_use_is_counted_and_told(ghest_rt: Run, tmp_path: Path) -> None:
    messy = write_blank_recording(tmp_path / "messy.mcap", encoder_copies=3)
    done = ghest_rt("estimate", messy, "--out", tmp_path / "a.csv")
    assert done.returncode == 0, done.stderr
    assert "42 encoder rows came again" in done.stdout
    done = ghest_rt("estimate", messy, "--out", tmp_path / "a.csv", "--json")
    assert json.loads(done.stdout)["unused"] == {"encoders_duplicate": 42}
    for speed in ("max", "1"):  # paced, the run ends with the cameras: what comes at the very end is not taken in
        done = ghest_rt("--replay", messy, "--speed", speed, "--json", "--no-publish")
        assert 20 <= json.loads(done.stdout)["runs"][0]["unused"]["encoders_duplicate"] <= 42


def test_schema_prints_all_messages(ghest_rt: Run, tmp_path: Path) -> None:
    assert set(json.loads(ghest_rt("schema").stdout)) == {"gh_angles", "health", "event"}
    assert ghest_rt("schema", "--out", tmp_path / "new").returncode == 0
    assert len(list((tmp_path / "new").glob("*.schema.json"))) == 3


def test_a_taken_port_is_one_message_and_exit_code_1(ghest_rt: Run, blank: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        done = ghest_rt("--replay", blank, "--listen", endpoint)
    assert done.returncode == 1
    assert endpoint in done.stderr
    assert "--listen" in done.stderr
    assert "Traceback" not in done.stderr


def _bad_station(folder: Path) -> Path:
    path = folder / "station.toml"
    path.write_text("format = 1\nrate_hz = 'fast'\n")
    return path


def _foreign(folder: Path) -> Path:
    path = folder / "holiday.mcap"
    path.write_bytes(b"GIF89a" + bytes(200))
    return path


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--replay", "{missing}"], "missing.mcap"),
        (["--replay", "{foreign}"], "holiday.mcap"),
        (["--replay", "{empty}"], "no recording"),
        (["--replay", "{blank}", "--station", "{bad_station}"], "rate_hz"),
        (["--replay", "{blank}", "--station", "{missing}"], "missing.mcap"),
        (["--replay", "{blank}", "--speed", "fast"], "--speed fast"),
        (["--replay", "{blank}", "--speed", "-1"], "--speed -1"),
        (["--replay", "{blank}", "--speed", "nan"], "--speed nan"),
        (["--replay", "{blank}", "--listen", "7447"], "tcp/127.0.0.1:7447"),
        (["--replay", "{blank}", "--method", "magic"], "magic"),
        ([], "--replay"),
        (["--replay", "{blank}", "schema"], "exclude"),
        (["run", "--station", "{missing}"], "missing.mcap"),
        (["run", "--station", "{bad_station}"], "cameras"),
        (["estimate", "{missing}", "--out", "{out}.csv"], "missing.mcap"),
        (["estimate", "{blank}", "--out", "{out}.xls"], ".csv or .parquet"),
        (["estimate", "{blank}", "--out", "{out}/no/such.csv"], "no such folder"),
        (["score", "{missing}"], "missing.mcap"),
        (["score", "{blank}"], "truth"),
        (["score", "{empty}"], "no recording"),
        (["simulate", "--out", "{out}.mcap"], "--movement"),
        (["simulate", "--out", "{out}.mcap", "--movement", "waltz"], "waltz"),
        (["listen", "--connect", "nowhere"], "nowhere"),
    ],
)
def test_wrong_use_and_bad_input_say_what_is_wrong(
    ghest_rt: Run, blank: Path, tmp_path: Path, arguments: list[str], told: str
) -> None:
    (tmp_path / "empty").mkdir()
    places = {
        "missing": tmp_path / "missing.mcap",
        "foreign": _foreign(tmp_path),
        "empty": tmp_path / "empty",
        "bad_station": _bad_station(tmp_path),
        "blank": blank,
        "out": tmp_path / "out",
    }
    done = ghest_rt(*(argument.format(**places) for argument in arguments))
    if arguments:
        assert done.returncode == 2, done.stderr
        assert told in done.stderr
    else:  # no arguments at all: the help
        assert told in done.stdout + done.stderr
    assert "Traceback" not in done.stderr
