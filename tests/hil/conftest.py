"""One running service for all tests that use it: on fixtures, or with `--station FILE` on a real station."""

import importlib.util
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.hil.rig import FIXTURES, Rig, fixture_rig, station_rig

_NEEDS = {
    "realsense-serial": {"mujoco": "sim", "pyrealsense2": "realsense", "serial": "serial"},
    "oak-can": {"mujoco": "sim", "depthai": "oak", "can": "can", "msgpack": "can"},
}


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--station", metavar="FILE", type=Path, help="run the tests in tests/hil on this station's hardware")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "rig" in metafunc.fixturenames:
        names = ("station",) if _station(metafunc.config) else FIXTURES
        metafunc.parametrize("rig", names, indirect=True, scope="session")


@pytest.fixture(scope="session")
def hil_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("hil")


@pytest.fixture(scope="session")
def rig(request: pytest.FixtureRequest, hil_folder: Path) -> Iterator[Rig]:
    station = _station(request.config)
    with ExitStack() as stack:
        if station is not None:
            yield stack.enter_context(station_rig(station))
            return
        skip_without_libraries(request.param)
        yield stack.enter_context(fixture_rig(request.param, hil_folder))


def skip_without_libraries(name: str) -> None:
    """Skip a test whose fixtures need a library that is not installed."""
    for module, extra in _NEEDS[name].items():
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{name} needs {module}: install ghest-rt[{extra}]")


def _station(config: pytest.Config) -> Path | None:
    station: Path | None = config.getoption("--station", None)
    return station
