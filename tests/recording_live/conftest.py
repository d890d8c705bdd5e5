"""A recorder with small frames to feed it."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.samples import CameraInfo, EncoderSample, Intrinsics, RgbdFrame
from ghest_rt.config.load import LoadedStation, parse_station
from ghest_rt.service.recorder import Recorder
from ghest_rt.service.recorder_parts import Parts
from ghest_rt.service.recorder_settings import RecorderSettings
from tests.recording.conftest import STATION_TOML, URDF

T0_NS = 7_000_000_000
PERIOD_NS = 10_000_000
JOINTS = ("j0", "j1")
STARTED_UNIX_NS = 1_700_000_000_000_000_000
STATION = LoadedStation(parse_station(STATION_TOML, "test"), STATION_TOML, URDF, "test")


def camera_info(name: str, width_px: int = 32, height_px: int = 24, fx_px: float = 30.0) -> CameraInfo:
    pinhole = Intrinsics(width_px, height_px, fx_px, 30.0, width_px / 2, height_px / 2)
    return CameraInfo(name, "fake", "1", pinhole, pinhole, 1e-4, np.eye(4), 100.0)


class Feed:
    """Frames and encoder samples, numbered, every 10 ms; the same seed gives the same pixels."""

    def __init__(self, width_px: int = 32, height_px: int = 24, t_0_ns: int = T0_NS) -> None:
        self.infos = {name: camera_info(name, width_px, height_px) for name in ("r0", "r1")}
        self._rng = np.random.default_rng(3)
        self._t_0_ns = t_0_ns

    def frame(self, name: str, seq: int) -> RgbdFrame:
        info, rng = self.infos[name], self._rng
        shape = (info.color.height_px, info.color.width_px)
        t_ns = self._t_0_ns + seq * PERIOD_NS
        color = rng.integers(0, 256, (*shape, 3), dtype=np.uint8)
        depth = rng.integers(0, 4096, shape, dtype=np.uint16)
        return RgbdFrame(info, seq, color, depth, t_ns - 5, t_ns, t_ns - 3_000_000, t_ns - 2_000_000)

    def sample(self, seq: int) -> EncoderSample:
        t_ns = self._t_0_ns + seq * PERIOD_NS + 1_000
        return EncoderSample(seq, self._rng.normal(size=2), t_ns // 1000, t_ns, t_ns - 900_000)

    def into(self, recorder: Recorder, seqs: range, cameras: tuple[str, ...] = ("r0", "r1")) -> list[RgbdFrame | EncoderSample]:
        """Feed a recorder; returns what it got, in the order of arrival."""
        fed: list[RgbdFrame | EncoderSample] = []
        for seq in seqs:
            for name in cameras:
                fed.append(frame := self.frame(name, seq))
                recorder.frame(frame)
            fed.append(sample := self.sample(seq))
            recorder.encoder(sample, JOINTS)
        return fed


MakeRecorder = Callable[..., Recorder]


@pytest.fixture
def make_recorder(tmp_path: Path) -> Iterator[MakeRecorder]:
    """Make recorders that write to the test's folder, with both cameras open; closed at the end."""
    made: list[Recorder] = []

    def make(settings: RecorderSettings | None = None, folder: Path = tmp_path, feed: Feed | None = None) -> Recorder:
        settings = settings or RecorderSettings()
        parts = Parts(folder, STATION, {"created_by": "test"}, settings, started_unix_ns=STARTED_UNIX_NS, now_ns=T0_NS)
        recorder = Recorder(parts, settings, MonotonicClock())
        recorder.start()
        for info in (feed or Feed()).infos.values():
            recorder.camera(info)
        made.append(recorder)
        return recorder

    yield make
    for recorder in made:
        recorder.close()
