"""A part of the installation that is missing: one message, one exit code."""

import tomllib
from pathlib import Path

import pytest

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
