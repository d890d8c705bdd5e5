"""The recordings that the benchmarks run on: simulated once, kept in out/benchmarks/."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from ghest_drivers.samples import EncoderSample, RgbdFrame
from ghest_rt.recording.reader import Recording
from ghest_rt.recording.writer import RecordingWriter

FOLDER = Path(__file__).resolve().parents[1] / "out" / "benchmarks"


def scene(sensor: str, marker: str, duration_s: float) -> Path:
    """Return a COMB recording of the sensor and marker texture asked for, simulating it if it is not there yet.

    The same seed gives the same poses, light and noise whatever the marker's texture. The movement ends after 30 s.
    """
    path = FOLDER / f"{sensor}-{marker}-{duration_s:g}s.mcap"
    if not path.exists():
        FOLDER.mkdir(parents=True, exist_ok=True)
        command = [str(Path(sys.executable).with_name("ghest-rt")), "simulate", "--movement", "COMB", "--sensor", sensor]
        command += ["--marker", marker, "--seed", "1", "--duration", str(duration_s), "--out", str(path)]
        subprocess.run(command, check=True)
    return path


def long_scene(duration_s: float) -> Path:
    """Return a recording of the paper's sensor that goes on for `duration_s`: ten seconds of COMB, again and again."""
    path = FOLDER / f"paper-long-{duration_s:g}s.mcap"
    if not path.exists():
        _repeat(scene("paper", "disks", 10.0), path, duration_s)
    return path


def _repeat(source: Path, path: Path, duration_s: float) -> None:
    recording = Recording(source)
    events = [event for event in recording.events() if isinstance(event, RgbdFrame | EncoderSample)]
    period_ns = round(666 * 1e9 / 66.6)
    first_frame_ns = min(event.t_capture_ns for event in events if isinstance(event, RgbdFrame))
    one_turn = [event for event in events if 0 <= event.t_capture_ns - first_frame_ns < period_ns]
    with RecordingWriter(path, recording.station, {"command": "benchmarks.scenes.long_scene"}) as writer:
        for info in recording.camera_infos.values():
            writer.add_camera(info, one_turn[0].t_arrival_ns)
        for turn in range(round(duration_s * 1e9 / period_ns) + 1):
            for event in one_turn:
                later = replace(
                    event,
                    seq=event.seq + turn * 1000,
                    t_device_ns=event.t_device_ns + turn * period_ns,
                    t_arrival_ns=event.t_arrival_ns + turn * period_ns,
                    t_capture_ns=event.t_capture_ns + turn * period_ns,
                )
                if isinstance(later, RgbdFrame):
                    writer.write_frame(replace(later, t_depth_capture_ns=later.t_depth_capture_ns + turn * period_ns))
                else:
                    writer.write_encoder(later, recording.encoder_joints)
