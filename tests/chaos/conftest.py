"""A folder with the scene that all fixtures of a module show."""

from pathlib import Path

import pytest

from tests.chaos.rig import RIG
from tests.hil.conftest import skip_without_libraries


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    skip_without_libraries(RIG)
    return tmp_path_factory.mktemp("chaos")
