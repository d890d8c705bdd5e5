"""The command that installs an extra: from where the installed distribution came."""

import shlex
from pathlib import Path
from typing import Any

import pytest

from ghest_drivers.installing import pip_install, requirement


@pytest.mark.parametrize(
    ("origin", "expected"),
    [
        (None, "'ghest-rt[can]'"),
        ({"url": "file:///nowhere/ghest-rt", "dir_info": {}}, "'/path/to/ghest-rt[can]'"),
        (
            {"url": "file:///a/ghest_rt-1-py3-none-any.whl", "archive_info": {}},
            "'ghest-rt[can] @ file:///a/ghest_rt-1-py3-none-any.whl'",
        ),
        (
            {"url": "https://b.org/g.git", "vcs_info": {"vcs": "git", "commit_id": "ab12"}},
            "'ghest-rt[can] @ git+https://b.org/g.git@ab12'",
        ),
        (
            {"url": "https://b.org/g.git", "vcs_info": {"vcs": "git", "commit_id": "ab12"}, "subdirectory": "rt"},
            "'ghest-rt[can] @ git+https://b.org/g.git@ab12#subdirectory=rt'",
        ),
    ],
)
def test_what_pip_is_given(origin: dict[str, Any] | None, expected: str) -> None:
    assert requirement(origin, "can") == expected


@pytest.mark.parametrize("name", ["with space", "O'Brien"])
def test_a_folder_that_is_still_there_is_named(tmp_path: Path, name: str) -> None:
    folder = tmp_path / name
    folder.mkdir()
    (folder / "pyproject.toml").touch()
    assert shlex.split(requirement({"url": folder.as_uri(), "dir_info": {}}, "can")) == [f"{folder}[can]"]
    assert shlex.split(requirement({"url": folder.as_uri(), "dir_info": {"editable": True}}, "")) == ["-e", str(folder)]


def test_the_installed_one_has_such_a_command() -> None:
    assert pip_install("can").startswith("pip install ")
    assert pip_install("can").endswith("[can]'")
