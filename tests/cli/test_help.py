"""Every command's help: plain words, and -h; --verbose wherever one writes it."""

import re
from collections.abc import Iterator
from typing import Any

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from ghest_rt.cli.main import app, main


def _commands(command: Any, words: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    yield words
    for name, child in getattr(command, "commands", {}).items():
        yield from _commands(child, (*words, name))


@pytest.mark.parametrize("words", list(_commands(get_command(app))), ids=" ".join)
def test_it_speaks_of_what_is_to_be_given_and_not_of_types(words: tuple[str, ...]) -> None:
    told = CliRunner().invoke(app, [*words, "-h"], env={"COLUMNS": "100"})
    assert told.exit_code == 0
    assert told.output == CliRunner().invoke(app, [*words, "--help"], env={"COLUMNS": "100"}).output
    assert not re.search(r"<[a-z]+[>\[|]|list\[", told.output, re.IGNORECASE)


@pytest.mark.parametrize("arguments", [["--verbose", "schema"], ["schema", "--verbose"], ["schema", "-v"]])
def test_verbose_may_stand_before_and_behind_the_command(arguments: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    monkeypatch.setattr("ghest_rt.cli.console.set_up_logging", asked.append)
    monkeypatch.setattr("sys.argv", ["ghest-rt", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    assert (ended.value.code, asked) == (0, [True])
