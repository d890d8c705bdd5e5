"""A small recording in which the cameras see nothing: enough to run the service on."""

from pathlib import Path

import numpy as np

from ghest_drivers.samples import CameraInfo, EncoderSample, Intrinsics, RgbdFrame
from ghest_rt.config.load import load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.recording.writer import RecordingWriter

PERIOD_NS = 15_015_015
LATENCY_NS = 2_000_000


def write_blank_recording(path: Path, frames: int = 20, encoder_copies: int = 1) -> Path:
    """Write `frames` black 128x128 frames of both cameras at 66.6 Hz and encoder samples that bracket them.

    Every encoder sample stands there `encoder_copies` times.
    """
    station = load_station(shipped_config_dir() / "station-sim.toml")
    joints = station.config.encoders.joints
    pinhole = Intrinsics(128, 128, 154.5, 154.5, 63.5, 63.5)
    infos = [CameraInfo(name, "blank", "0", pinhole, pinhole, 1e-5, np.eye(4), 66.6) for name in ("r0", "r1")]
    black, nothing = np.zeros((128, 128, 3), np.uint8), np.zeros((128, 128), np.uint16)
    with RecordingWriter(path, station, {"created_by": "test"}) as writer:
        for info in infos:
            writer.add_camera(info, 0)
        for k in range(frames + 1):
            t_ns = k * PERIOD_NS
            sample = EncoderSample(k, np.zeros(len(joints)), t_ns, t_ns + LATENCY_NS, t_ns)
            for _ in range(encoder_copies):
                writer.write_encoder(sample, joints)
            for info in infos if k < frames else []:
                writer.write_frame(RgbdFrame(info, k, black, nothing, t_ns, t_ns + LATENCY_NS, t_ns, t_ns))
    return path
