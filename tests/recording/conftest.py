"""A small recording, and what was written into it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from ghest_drivers.samples import CameraInfo, EncoderSample, Intrinsics, RgbdFrame
from ghest_rt.config.load import LoadedStation, parse_station
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3
from ghest_rt.messages.results import TruthSample
from ghest_rt.recording.decoding import Event
from ghest_rt.recording.writer import RecordingWriter

T0_NS = 1_234_567_890_123
PERIOD_NS = 15_015_015

STATION_TOML = """\
format = 1
station = { id = "test", arm = "right" }
exoskeleton = { urdf = "exo.urdf" }
encoders = { joints = ["j0", "j1"], device = { backend = "replay" } }

[markers.m0]
half_spacing_m = 0.018
disk_radius_m = 0.008
plate_m = 0.06
disk_rgb = [[214, 40, 57], [124, 181, 24], [0, 158, 165], [122, 62, 180]]

[markers.m1]
half_spacing_m = 0.018
disk_radius_m = 0.008
plate_m = 0.06
disk_rgb = [[214, 40, 57], [124, 181, 24], [0, 158, 165], [122, 62, 180]]

[cameras]
r0 = { link = "l0", marker = "m0", device = { backend = "replay" } }
r1 = { link = "l8", marker = "m1", device = { backend = "replay" } }

[calibration]
id = "test"
m0_from_gh = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
m1_from_elw = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
link_from_camera.r0 = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
link_from_camera.r1 = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
"""
URDF = "<robot name='exo'/>\n"


@dataclass(frozen=True)
class Material:
    """What goes into a recording, in the order of arrival."""

    station: LoadedStation
    infos: dict[str, CameraInfo]
    joints: tuple[str, ...]
    events: list[Event]

    def write(self, path: Path, **kwargs: str) -> Path:
        with RecordingWriter(path, self.station, {"created_by": "test"}, **kwargs) as writer:  # type: ignore[arg-type]
            for info in self.infos.values():
                writer.add_camera(info, T0_NS)
            for event in self.events:
                if isinstance(event, RgbdFrame):
                    writer.write_frame(event)
                elif isinstance(event, EncoderSample):
                    writer.write_encoder(event, self.joints)
                else:
                    writer.write_truth(event)
        return path


def _pose(rng: np.random.Generator) -> np.ndarray:
    return transform(exp_so3(rng.normal(size=3)), rng.normal(size=3))


def make_material(ticks: int = 12, width_px: int = 16, height_px: int = 12) -> Material:
    rng = np.random.default_rng(7)
    color = Intrinsics(width_px, height_px, 20.1, 20.2, 7.3, 5.9, (0.1, -0.2, 1e-3, -2e-3, 1 / 3))
    depth = Intrinsics(width_px + 2, height_px + 1, 21.0, 21.5, 8.5, 6.5)
    infos = {
        name: CameraInfo(name, "synthetic", f"sn-{name}", color, depth, 0.000125, _pose(rng), 66.6) for name in ("r0", "r1")
    }
    events: list[Event] = []
    for k in range(ticks):
        t_ns = T0_NS + round(k * PERIOD_NS)
        events.append(
            TruthSample(t_ns, exp_so3(rng.normal(size=3)), _pose(rng), _pose(rng), _pose(rng), _pose(rng), {"j0": 0.1 / 3})
        )
        events.append(EncoderSample(k, rng.normal(size=2), t_ns + 77, t_ns + 1_000_000, t_ns + 100))
        for number, info in enumerate(infos.values()):
            counts = rng.integers(0, 65536, (depth.height_px, depth.width_px), np.uint16)
            events.append(
                RgbdFrame(
                    info=info,
                    seq=k + 5,
                    color_rgb=rng.integers(0, 256, (height_px, width_px, 3), np.uint8),
                    depth_counts=None if k == 3 else counts,
                    t_device_ns=t_ns if k == 4 else k * 15_000 - 30_000,
                    t_arrival_ns=t_ns + 5_000_000 + number,
                    t_capture_ns=t_ns,
                    t_depth_capture_ns=t_ns if k == 3 else t_ns - 3_000_000,
                )
            )
    station = LoadedStation(parse_station(STATION_TOML, "test"), STATION_TOML, URDF, "test")
    return Material(station, infos, ("j0", "j1"), events)


@pytest.fixture(scope="session")
def material() -> Material:
    return make_material()


@pytest.fixture
def recording_path(material: Material, tmp_path: Path) -> Path:
    return material.write(tmp_path / "small.mcap")
