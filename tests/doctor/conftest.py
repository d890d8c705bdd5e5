"""The station that most tests look at."""

import pytest

from ghest_rt.config.shipped import shipped_config_dir


@pytest.fixture
def station_text() -> str:
    """The shipped SR300 station, with a port that no machine has."""
    text = (shipped_config_dir() / "station-sr300-serial.toml").read_text()
    return text.replace("/dev/ttyUSB0", "/dev/ttyNoSuchPort")
