"""A simulated calibration session, and a station file that knows nothing of it yet."""

import shutil
from pathlib import Path

import pytest

from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.simulation.command import simulate
from ghest_rt.simulation.options import SimulateOptions


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Movement CAL, the paper's sensor."""
    out = tmp_path_factory.mktemp("recordings") / "tuesday.mcap"
    simulate(SimulateOptions(out=out, movement="CAL", seed=11), lambda _: None)
    return out


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of its own with the shipped stations and their URDFs."""
    for name in ("station-sim.toml", "armeo_spring.urdf"):
        shutil.copy(shipped_config_dir() / name, tmp_path)
    return tmp_path
