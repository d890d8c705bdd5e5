"""Recordings and a way to run the command line as a user does."""

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.recordings import write_blank_recording
from tests.program import COMMAND

Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="session")
def blank(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short recording in which the cameras see nothing."""
    return write_blank_recording(tmp_path_factory.mktemp("recordings") / "blank.mcap")


@pytest.fixture
def ghest_rt() -> Run:
    """Run `ghest-rt` with arguments, to its end."""

    def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
        command = [*COMMAND, *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)

    return run
