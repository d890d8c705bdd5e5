"""Stations to be looked at, and what a machine may have connected."""

import re
from pathlib import Path

from ghest_drivers.hardware.probe import ProbeResult
from ghest_rt.cli.doctor.devices import Present
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.shipped import shipped_config_dir

NOTHING = Present({"realsense": ProbeResult(()), "oak": ProbeResult(())}, [], [], [])
SR300 = {"model": "Intel RealSense SR300", "serial": "123", "firmware": "3.26.1.0", "usb": "3.0"}


def station_of(tmp_path: Path, text: str) -> LoadedStation:
    urdf = (shipped_config_dir() / "armeo_spring.urdf").read_text()
    (tmp_path / "armeo_spring.urdf").write_text(urdf)
    path = tmp_path / "station.toml"
    path.write_text(text)
    return load_station(path)


def with_device(text: str, table: str, device: str) -> str:
    """Replace the device line of a table."""
    return re.sub(rf"(\[{re.escape(table)}\].*?\ndevice = )[^\n]*", lambda match: match[1] + device, text, flags=re.DOTALL)
