"""Every example of docs/encoder-links.md becomes a link; what does not fit is refused with its place."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.hardware.encoders.binary_frame import BinaryFormat
from ghest_drivers.hardware.encoders.can_log import CanLogSettings
from ghest_drivers.hardware.encoders.canopen_link import CanopenSettings
from ghest_drivers.hardware.encoders.file_link import FileEncoderLink
from ghest_drivers.hardware.encoders.link import SampleQueueLink
from ghest_drivers.hardware.encoders.serial_link import SerialEncoderLink, SerialSettings
from ghest_drivers.hardware.encoders.text_line import TextFormat
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.station import Encoders
from ghest_rt.errors import BadInputError
from ghest_rt.service.encoder_device import encoder_settings, make_encoder_link

ROOT = Path(__file__).parents[2]
EXAMPLES = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "encoder-links.md").read_text(encoding="utf-8"), re.DOTALL)
BASE = load_station(ROOT / "config" / "station-sr300-serial.toml")


def station(encoders: dict[str, Any]) -> LoadedStation:
    config = BASE.config.model_copy(update={"encoders": Encoders.model_validate(encoders)})
    return LoadedStation(config, BASE.toml_text, BASE.urdf_text, BASE.source)


def settings_of(index: int) -> Any:
    loaded = station(tomllib.loads(EXAMPLES[index]))
    return encoder_settings(loaded, loaded.config.encoders.device)  # type: ignore[arg-type]


@pytest.mark.parametrize("example", EXAMPLES, ids=[tomllib.loads(text)["device"]["backend"] for text in EXAMPLES])
def test_examples_become_links(example: str) -> None:
    link = make_encoder_link(station(tomllib.loads(example)), MonotonicClock())
    assert isinstance(link, SampleQueueLink | FileEncoderLink)


def test_the_shipped_station_file_becomes_a_link() -> None:
    assert isinstance(make_encoder_link(BASE, MonotonicClock()), SerialEncoderLink)


def test_the_documented_frame_is_the_default() -> None:
    settings = settings_of(0)
    assert isinstance(settings, SerialSettings)
    assert isinstance(settings.layout, BinaryFormat)
    assert settings.layout.size_bytes == 42
    assert [channel.source for channel in settings.channels] == [f"a{k}" for k in range(7)]
    assert settings.channels[0].rad_per_count == pytest.approx(np.radians(1e-4))


def test_binary_settings_arrive_in_the_driver_s_units() -> None:
    settings = settings_of(1)
    assert settings.counting.wrap_ticks == 1 << 16
    assert settings.counting.tick_ns == 100_000
    assert settings.counting.latency_ns == 400_000
    assert settings.layout.encode({}).startswith(b"\x02\x00\x00")
    first, second = settings.channels
    assert (first.source, first.sign, first.zero_counts) == ("shoulder", -1, 2048)
    assert first.rad_per_count == pytest.approx(2 * np.pi / 4096)
    assert second.wrap


def test_plausibility_comes_from_the_urdf_unless_given() -> None:
    j0, _, j2 = settings_of(2).channels
    assert (j0.min_rad, j0.max_rad) == pytest.approx((-4.4 - np.radians(3), 4.4 + np.radians(3)))
    assert j0.max_rate_rad_s == pytest.approx(20.0)
    assert (j2.min_rad, j2.max_rad) == pytest.approx(tuple(np.radians((-80, 80))))
    assert j2.max_rate_rad_s == pytest.approx(np.radians(500))


def test_text_log_and_canopen_settings() -> None:
    text, log, nodes = settings_of(2), settings_of(4), settings_of(5)
    assert isinstance(text.layout, TextFormat)
    assert (text.layout.decimal_comma, text.layout.time_decimals, text.counting.seq_modulus) == (True, 3, None)
    assert isinstance(log, CanLogSettings)
    assert log.path == ROOT / "config" / "session.blf"
    assert isinstance(nodes, CanopenSettings)
    assert (nodes.node_ids, nodes.bus.bitrate, nodes.sync_period_ms) == ((5, 6), 500_000, 10)


A_SIGNAL = {"j0": {"source": "A.B", "deg_per_count": 1.0}}
J0_DEG = {"j0": {"deg_per_count": 1.0}}
SERIAL = {"backend": "serial", "port": "/dev/x"}


@pytest.mark.parametrize(
    ("joints", "device", "message"),
    [
        (["j0", "no"], SERIAL, "no is not a joint of armeo_spring.urdf"),
        (["j0"], {**SERIAL, "channels": {"j7": {}}}, "j7 is not in encoders.joints"),
        (["j0"], {**SERIAL, "channels": {"j0": {"source": "a9"}}}, "no field 'a9' in the frame; its values are a0"),
        (["j0"], {**SERIAL, "layout": {"kind": "text", "fields": ["a0"]}}, "j0: deg_per_count or counts_per_turn"),
        (["j0"], {**SERIAL, "layout": {"kind": "text", "fields": ["a0"], "delimiter": "."}, "channels": J0_DEG}, "delimiter"),
        (["j0"], {**SERIAL, "channels": {"j0": {"wrap": True}}}, "joint j0: a single-turn encoder"),
        (["j0"], {"backend": "armeo", "path": "x.csv"}, "channels.j0.source: must be given"),
        (
            ["j0"],
            {"backend": "can_log", "path": "x", "dbc": "none.dbc", "channels": A_SIGNAL},
            r"none\.dbc: cannot read the DBC",
        ),
        (["j0"], {"backend": "sim"}, "the backend sim is no hardware"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(joints: list[str], device: dict[str, Any], message: str) -> None:
    with pytest.raises(BadInputError, match=message):
        make_encoder_link(station({"joints": joints, "device": device}), MonotonicClock())


@pytest.mark.parametrize(
    "device",
    [
        {**SERIAL, "bauds": 9600},
        {**SERIAL, "channels": {"j0": {"deg_per_count": 1.0, "counts_per_turn": 4096}}},
        {**SERIAL, "channels": {"j0": {"range_deg": [10, -10]}}},
        {**SERIAL, "channels": {"j0": {"sign": 2}}},
        {**SERIAL, "layout": {"kind": "binary", "fields": ["a0:i12"]}},
        {"backend": "can", "bus": {"interface": "socketcan"}, "dbc": "x.dbc"},
    ],
)
def test_wrong_keys_and_values_are_refused_by_the_schema(device: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="validation error"):
        Encoders.model_validate({"joints": ["j0"], "device": device})
