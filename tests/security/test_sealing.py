"""Sealed recordings: never in plain on the disk, the same when opened, whole up to the last moment whatever ends them."""

import subprocess
import threading
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ghest_drivers.clock import MonotonicClock
from ghest_rt.cli.main import app
from ghest_rt.errors import BadInputError
from ghest_rt.recording.reader import Recording
from ghest_rt.recording.scan import MAGIC
from ghest_rt.security.sealing import check_recipients, make_recording_key
from ghest_rt.security.subjects import check_subject
from ghest_rt.security.unsealing import load_keys, unseal
from ghest_rt.service.recorder import Recorder
from ghest_rt.service.recorder_parts import Parts
from ghest_rt.service.recorder_settings import RecorderSettings
from tests.program import COMMAND
from tests.recording_live.conftest import STARTED_UNIX_NS, STATION, T0_NS, Feed
from tests.recording_live.feeding import FEEDER, RATE_HZ, ROOT, feed_until_killed, newest


class Key:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.public = make_recording_key(path)


@pytest.fixture
def key(tmp_path: Path) -> Key:
    return Key(tmp_path / "secret.txt")


def record(folder: Path, recipients: tuple[str, ...], samples: int = 40) -> list[Path]:
    settings = RecorderSettings(recipients=recipients, flush_ns=10**15)  # so that chunks end at the same places
    parts = Parts(folder, STATION, {"created_by": "test"}, settings, started_unix_ns=STARTED_UNIX_NS, now_ns=T0_NS)
    recorder = Recorder(parts, settings, MonotonicClock())
    recorder.start()
    feed = Feed(160, 120)
    for info in feed.infos.values():
        recorder.camera(info)
    feed.into(recorder, range(samples))
    counts = recorder.close()
    assert (counts.failure, counts.dropped) == ("", {})
    return counts.parts


def open_sealed(path: Path, key: Key, out: Path) -> Path:
    restored = unseal(path, out, load_keys(key.path), lambda _: None)
    assert restored.size_bytes == out.stat().st_size
    return out


def messages(path: Path) -> list[str]:
    return [str(event) for event in Recording(path).events()]


def test_a_sealed_recording_is_the_plain_one_again_when_opened(tmp_path: Path, key: Key) -> None:
    (plain,) = record(tmp_path / "plain", ())
    (sealed,) = record(tmp_path / "sealed", (key.public,))
    assert sealed.name == plain.name + ".age"
    opened = open_sealed(sealed, key, tmp_path / "opened.mcap")
    assert messages(opened) == messages(plain)
    assert opened.stat().st_mode & 0o077 == 0


def test_nothing_of_it_is_on_the_disk_in_plain(tmp_path: Path, key: Key) -> None:
    record(tmp_path / "sealed", (key.public,))
    (file,) = (tmp_path / "sealed").iterdir()
    data = file.read_bytes()
    assert not any(words in data for words in (MAGIC, b"station.toml", b"/r0/color/image", STATION.urdf_text[:40].encode()))


def test_each_of_several_keys_opens_it_and_no_other(tmp_path: Path, key: Key) -> None:
    second, stranger = Key(tmp_path / "second.txt"), Key(tmp_path / "stranger.txt")
    (sealed,) = record(tmp_path / "sealed", (key.public, second.public), samples=3)
    assert messages(open_sealed(sealed, key, tmp_path / "1.mcap")) == messages(open_sealed(sealed, second, tmp_path / "2.mcap"))
    with pytest.raises(BadInputError, match="sealed for another key"):
        open_sealed(sealed, stranger, tmp_path / "3.mcap")
    assert not (tmp_path / "3.mcap").exists()


def test_kill_9_loses_at_most_the_last_second(tmp_path: Path, key: Key) -> None:
    folder = tmp_path / "sealed"
    last = feed_until_killed(folder, "--recipient", key.public, at=150)
    (sealed,) = folder.iterdir()
    before, size = -1, sealed.stat().st_size
    pause = threading.Event()
    while size != before:  # the sealing process finishes by itself
        pause.wait(0.3)
        before, size = size, sealed.stat().st_size
    restored = unseal(sealed, tmp_path / "opened.mcap", load_keys(key.path), lambda _: None)
    assert restored.whole
    assert min(newest(Recording(restored.path)).values()) >= last - RATE_HZ


def test_a_full_disk_is_told_and_what_was_sealed_can_be_opened(tmp_path: Path, key: Key) -> None:
    folder = tmp_path / "sealed"
    command = [*FEEDER, folder, "--seconds", "1.5", "--max-file-bytes", "2000000", "--recipient", key.public]
    ended = subprocess.run(list(map(str, command)), capture_output=True, text=True, cwd=ROOT, timeout=60, check=True)
    assert ended.stderr == ""
    assert "File too large" in ended.stdout.splitlines()[-1]
    (sealed,) = folder.iterdir()
    restored = unseal(sealed, tmp_path / "opened.mcap", load_keys(key.path), lambda _: None)
    assert not restored.whole
    assert restored.size_bytes > 1_500_000
    assert newest(Recording(restored.path))


def test_what_is_cut_off_or_changed_is_restored_up_to_there(tmp_path: Path, key: Key) -> None:
    (sealed,) = record(tmp_path / "sealed", (key.public,))
    data = sealed.read_bytes()
    whole = open_sealed(sealed, key, tmp_path / "whole.mcap").read_bytes()
    flipped = data[:700_000] + bytes([data[700_000] ^ 1]) + data[700_001:]
    for number, bad in enumerate((data[:700_000], flipped)):
        sealed.write_bytes(bad)
        restored = unseal(sealed, tmp_path / f"{number}.mcap", load_keys(key.path), lambda _: None)
        assert not restored.whole
        assert restored.size_bytes > 600_000
        assert whole.startswith(restored.path.read_bytes())


def test_a_sealed_recording_is_not_taken_for_a_plain_one(tmp_path: Path, key: Key) -> None:
    (sealed,) = record(tmp_path / "sealed", (key.public,), samples=3)
    with pytest.raises(BadInputError, match="ghest-rt decrypt"):
        Recording(sealed)


def test_keys_that_cannot_be_used_are_refused(tmp_path: Path, key: Key) -> None:
    secret = key.path.read_text().splitlines()[1]
    with pytest.raises(BadInputError, match="secret key") as caught:
        check_recipients([secret])
    assert secret not in str(caught.value)
    with pytest.raises(BadInputError, match="recording-key makes a pair"):
        check_recipients([key.public[:-1]])
    with pytest.raises(BadInputError, match="would be lost"):
        make_recording_key(key.path)
    key.path.chmod(0o644)
    with pytest.raises(BadInputError, match="chmod 600"):
        load_keys(key.path)
    (recording,) = record(tmp_path / "plain", (), samples=3)
    recording.chmod(0o644)
    with pytest.raises(BadInputError, match="holds no secret key"):  # and no advice to guard what is none
        load_keys(recording)
    empty = tmp_path / "empty.txt"
    empty.touch(0o600)
    with pytest.raises(BadInputError, match="holds no secret key"):
        load_keys(empty)


def test_the_commands(tmp_path: Path) -> None:
    run = CliRunner()
    made = run.invoke(app, ["recording-key", "--out", str(tmp_path / "k.txt")], catch_exceptions=False).output
    public = next(word for word in made.split() if word.startswith("age1"))
    (sealed,) = record(tmp_path / "sealed", (public,), samples=3)
    arguments = ["decrypt", str(sealed.parent), "--key", str(tmp_path / "k.txt"), "--out", str(tmp_path / "open")]
    told = run.invoke(app, arguments, catch_exceptions=False).output
    assert sealed.name.removesuffix(".age") in told
    assert len(messages(tmp_path / "open" / sealed.name.removesuffix(".age"))) == 9
    with pytest.raises(BadInputError, match="exists already"):
        run.invoke(app, arguments, catch_exceptions=False)


def test_the_command_keeps_what_comes_before_a_change_and_ends_with_an_error(tmp_path: Path, key: Key) -> None:
    first, second = (record(tmp_path / name, (key.public,))[0] for name in ("a", "b"))
    data = first.read_bytes()
    first.write_bytes(data[:700_000] + bytes([data[700_000] ^ 1]) + data[700_001:])
    second = second.rename(tmp_path / "other.mcap.age")
    command = [*COMMAND, "decrypt", str(first), str(second), "--key", str(key.path), "--out", str(tmp_path / "open")]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 2
    assert f"{first}: cut off or changed" in ended.stderr
    assert messages(tmp_path / "open" / "other.mcap") == messages(open_sealed(second, key, tmp_path / "whole.mcap"))
    kept = (tmp_path / "open" / first.name.removesuffix(".age")).stat().st_size
    assert 600_000 < kept < (tmp_path / "open" / "other.mcap").stat().st_size


def test_the_command_tells_of_every_file_whatever_becomes_of_the_others(tmp_path: Path, key: Key) -> None:
    first, second, third = (record(tmp_path / name, (key.public,))[0].rename(tmp_path / f"{name}.mcap.age") for name in "abc")
    first.write_bytes(first.read_bytes()[:700_000])
    out = tmp_path / "open"
    out.mkdir()
    (out / "b.mcap").touch()
    files = [str(path) for path in (first, second, third)]
    command = [*COMMAND, "decrypt", *files, "--key", str(key.path), "--out", str(out)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == 2
    assert f"{first}: cut off or changed" in ended.stderr
    assert f"{out / 'b.mcap'} exists already" in ended.stderr
    assert messages(out / "c.mcap") == messages(open_sealed(third, key, tmp_path / "whole.mcap"))


@pytest.mark.parametrize("pseudonym", ["P-0042", "P0042", "AB-17", "XYZ-99999"])
def test_pseudonyms(pseudonym: str) -> None:
    assert check_subject(pseudonym) == pseudonym


@pytest.mark.parametrize(
    "text",
    [
        "Jane",
        "DOE",
        "JD-19800512",
        "JD-120580",
        "1980-05-12",
        "12.05.1980",
        "P-1234567",
        "jd-17",
        "J D-17",
        "Q-0043\n",
        "",
        "P-٠٤٢",
    ],
)
def test_what_looks_like_a_name_or_a_date_is_refused_and_not_repeated(text: str) -> None:
    with pytest.raises(BadInputError, match="not a pseudonym") as caught:
        check_subject(text)
    assert len(text) < 3 or text.strip() not in str(caught.value)


def test_neither_pseudonym_nor_key_is_in_what_a_run_prints_or_logs(tmp_path: Path, key: Key) -> None:
    station = ROOT / "config" / "station-sim.toml"
    command = [*COMMAND, "--verbose", "record", "--station", str(station), "--no-publish"]
    command += ["--out", str(tmp_path / "sealed"), "--duration", "1.5", "--subject", "ZQX-90417", "--encrypt-to", key.public]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert "ZQX-90417" not in ended.stdout + ended.stderr
    (sealed,) = (tmp_path / "sealed").iterdir()
    assert "ZQX" not in sealed.name
    assert Recording(open_sealed(sealed, key, tmp_path / "x.mcap")).facts["subject"] == "ZQX-90417"
