"""A part of the installation that is missing: one message, one exit code."""

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ghest_rt.cli.main import app
from ghest_rt.cli.table_file import writer_for
from ghest_rt.errors import GhestError
from ghest_rt.extras import MODULES_OF_EXTRA, missing_modules, need_extra

_PROJECT = Path(__file__).parents[2] / "pyproject.toml"
_ON_THE_SIDE = {"dev", "audit"}  # for those who develop ghest-rt


def test_every_extra_of_the_project_is_known() -> None:
    extras = tomllib.loads(_PROJECT.read_text())["project"]["optional-dependencies"]
    assert set(MODULES_OF_EXTRA) == set(extras) - _ON_THE_SIDE


@pytest.mark.parametrize("extra", MODULES_OF_EXTRA)
def test_a_missing_extra_is_told_by_name_and_remedy(extra: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(GhestError, match=rf"this needs .*: pip install .*\[{extra}\]") as caught:
        need_extra(extra, "this")
    assert caught.value.exit_code == 1
    assert all(module in str(caught.value) for module in MODULES_OF_EXTRA[extra])


def test_an_extra_that_is_installed_lacks_nothing() -> None:
    assert missing_modules("sim") == []


def test_a_parquet_file_needs_the_extra_and_a_csv_file_does_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    writer_for(tmp_path / "angles.csv")
    with pytest.raises(GhestError, match=r"angles.parquet .* needs pyarrow") as caught:
        writer_for(tmp_path / "angles.parquet")
    assert caught.value.exit_code == 1


_EVERY_HELP = """
import sys
from typer.main import get_command
from typer.testing import CliRunner
from ghest_rt.extras import MODULES_OF_EXTRA

sys.modules.update(dict.fromkeys((name for names in MODULES_OF_EXTRA.values() for name in names), None))
from ghest_rt.cli.main import app


def walk(command, words):
    done = CliRunner().invoke(app, [*words, "--help"])
    if done.exit_code:
        print(*words, done.exception)
    for name, child in getattr(command, "commands", {}).items():
        walk(child, [*words, name])


walk(get_command(app), [])
"""


def test_help_needs_no_extra() -> None:
    done = subprocess.run([sys.executable, "-c", _EVERY_HELP], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("", "")


def test_what_runs_without_its_extra_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    for words in (["init", "--clinic", "A"], ["list"], ["check", str(tmp_path)], ["revoke", "therapy.game-1"]):
        with pytest.raises(GhestError, match="an authority needs cryptography"):
            CliRunner().invoke(app, ["certs", *words], catch_exceptions=False)
