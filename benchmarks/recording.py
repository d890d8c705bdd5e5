"""Live recording of 2 x 640x480 RGB-D at 60 Hz: frames a second, drops, MB/s; alone, and with the whole service beside it.

Frames are those of the simulated SR300, made before and played to and fro at 60 Hz; the disk is that of the folder given:
`python -m benchmarks.recording [--seconds 20] [--folder out/benchmarks]` from the project's root.
"""

import argparse
import asyncio
import json
import shutil
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import DeviceLost, ReadTimeout
from ghest_drivers.samples import CameraInfo, RgbdFrame
from ghest_drivers.sim import SimEncoders
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.service.clocks import ScaledClock
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.contract import ServiceSettings, ServiceSummary
from ghest_rt.service.loop import Service
from ghest_rt.service.process import punctual_process
from ghest_rt.service.recorder import Recorder
from ghest_rt.service.recorder_parts import Parts
from ghest_rt.service.recorder_settings import RecorderCounts, RecorderSettings
from ghest_rt.service.recorder_taps import RecordedCamera, RecordedEncoders, RecorderOutput
from ghest_rt.simulation.building import build_world
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.simulation.world import World

_RATE_HZ = 60
_POOL = 12
_QUEUE = 8  # frames that the driver of a real camera holds


class PooledCamera:
    """A camera at 60 Hz with a few frames made before; late reads lose frames as with a real one."""

    def __init__(self, frames: list[RgbdFrame], clock: MonotonicClock) -> None:
        self._frames = [*frames, *frames[-2:0:-1]]
        self._clock = clock
        self._start_ns = 0
        self._next = 0
        self._closed = threading.Event()
        self.lost = 0

    @property
    def info(self) -> CameraInfo:
        """The frames' camera."""
        return self._frames[0].info

    def open(self) -> None:
        """Start."""
        self._closed.clear()
        self._start_ns = self._clock.now_ns()

    def read(self, timeout_s: float) -> RgbdFrame:
        """Return the next frame when it is due."""
        if self._closed.is_set():
            raise DeviceLost("closed")
        now_ns = self._clock.now_ns()
        newest = (now_ns - self._start_ns) * _RATE_HZ // 1_000_000_000
        if newest - self._next > _QUEUE:
            self.lost += newest - self._next - _QUEUE
            self._next = newest - _QUEUE
        due_ns = self._start_ns + self._next * 1_000_000_000 // _RATE_HZ
        if due_ns - now_ns > timeout_s * 1e9:
            raise ReadTimeout("not due")
        self._clock.sleep_until_ns(due_ns)
        seq, self._next = self._next, self._next + 1
        frame = self._frames[seq % len(self._frames)]
        t_ns = due_ns - 8_000_000
        return replace(frame, seq=seq, t_device_ns=t_ns, t_arrival_ns=due_ns, t_capture_ns=t_ns, t_depth_capture_ns=t_ns)

    def close(self) -> None:
        """Stop."""
        self._closed.set()


def run(quick: bool) -> dict[str, Any]:
    """Measure on the disk of the working folder."""
    return measure(5.0 if quick else 20.0, Path("out/benchmarks"))


def measure(seconds: float, folder: Path) -> dict[str, Any]:
    """Measure both for so long each."""
    station = shipped_config_dir() / "station-sr300-sim.toml"
    world = build_world(SimulateOptions(out=Path(), movement="SFE", sensor="sr300", seed=1, duration_s=2.0, station=station))
    with ThreadPoolExecutor(2) as pool:
        pools = dict(zip(("r0", "r1"), pool.map(lambda name: _frames(world, name), ("r0", "r1")), strict=True))
    folder.mkdir(parents=True, exist_ok=True)
    return {
        "recorder_alone": _in_folder(folder, lambda where: _alone(world, pools, where, seconds)),
        "with_service": _in_folder(folder, lambda where: _with_service(world, pools, where, seconds)),
    }


def _frames(world: World, name: str) -> list[RgbdFrame]:
    found = [world.frame(name, k) for k in range(_POOL)]
    return [frame for frame in found if frame is not None]


def _in_folder(folder: Path, do: Any) -> dict[str, Any]:
    where = Path(tempfile.mkdtemp(prefix="recording-", dir=folder))
    try:
        result: dict[str, Any] = do(where)
        return result
    finally:
        shutil.rmtree(where)


def _recorder(world: World, where: Path, clock: MonotonicClock | ScaledClock) -> Recorder:
    settings = RecorderSettings()
    parts = Parts(where, world.station, {}, settings, started_unix_ns=time.time_ns(), now_ns=clock.now_ns())
    recorder = Recorder(parts, settings, clock)
    recorder.start()
    return recorder


def _alone(world: World, pools: dict[str, list[RgbdFrame]], where: Path, seconds: float) -> dict[str, Any]:
    clock = MonotonicClock()
    recorder = _recorder(world, where, clock)
    cameras = {name: PooledCamera(frames, clock) for name, frames in pools.items()}
    cpu_s, t_s = time.process_time(), time.monotonic()

    def read(camera: PooledCamera) -> None:
        tapped = RecordedCamera(camera, recorder)
        tapped.open()
        for _ in range(round(seconds * _RATE_HZ) - camera.lost):
            tapped.read(1.0)

    threads = [threading.Thread(target=read, args=(camera,)) for camera in cameras.values()]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    took_s = time.monotonic() - t_s
    counts = recorder.close()
    cpu_percent = 100 * (time.process_time() - cpu_s) / took_s
    return {**_figures(counts, cameras, took_s), "cpu_percent_of_one_core": round(cpu_percent, 1)}


def _with_service(world: World, pools: dict[str, list[RgbdFrame]], where: Path, seconds: float) -> dict[str, Any]:
    clock = ScaledClock()
    recorder = _recorder(world, where, clock)
    cameras = {name: PooledCamera(frames, MonotonicClock()) for name, frames in pools.items()}
    config = world.station.config
    output = RecorderOutput(recorder)
    service = Service(
        settings=ServiceSettings(config.rate_hz, round(config.estimator.lag_ms * 1e6)),
        cameras={name: RecordedCamera(camera, recorder) for name, camera in cameras.items()},
        encoders=RecordedEncoders(SimEncoders(world, clock, clock.now_ns()), recorder),
        make_pipeline=lambda infos, joints: Pipeline(world.station, infos, joints),
        composer=AnglesComposer(config.station.arm, config.estimator.method, config.calibration.id, 0, Numbering()),
        outputs=(output,),
        clock=clock,
    )
    output.attach(service)

    async def run_it() -> ServiceSummary:
        asyncio.get_running_loop().call_later(seconds, service.stop)
        return await service.run()

    t_s = time.monotonic()
    with punctual_process():
        summary = asyncio.run(run_it())
    took_s = time.monotonic() - t_s
    figures = _figures(recorder.close(), cameras, took_s)
    figures["published_hz"] = round(summary.published / took_s, 2)
    figures["tick_late_p99_ms"] = round(summary.lateness.p99_us / 1000, 2)
    figures["missed_ticks"] = summary.missed_ticks
    figures["frames_not_through_vision"] = sum(counters.skipped for counters in summary.inputs.values())
    return figures


def _figures(counts: RecorderCounts, cameras: dict[str, PooledCamera], took_s: float) -> dict[str, Any]:
    return {
        "seconds": round(took_s, 1),
        "frames_per_s_per_camera": round(counts.written["/r0/color/image"] / took_s, 2),
        "frames_lost_before_the_recorder": sum(camera.lost for camera in cameras.values()),
        "dropped_by_the_recorder": sum(counts.dropped.values()),
        "mb_per_s": round(counts.written_bytes / 1e6 / took_s, 1),
        "longest_wait_ms": round(counts.max_wait_ns / 1e6, 1),
        "failure": counts.failure,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--folder", type=Path, default=Path("out/benchmarks"))
    arguments = parser.parse_args()
    print(json.dumps(measure(arguments.seconds, arguments.folder), indent=2))


if __name__ == "__main__":
    main()
