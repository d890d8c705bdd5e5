"""Samples per second of `ghest-rt estimate`, reading the file included."""

import time
from typing import Any

from benchmarks.scenes import scene
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.recording.reader import Recording


def run(quick: bool) -> dict[str, Any]:
    """Estimate a recording of each sensor from the file, as the command does."""
    results: dict[str, Any] = {}
    for sensor, size in (("paper", "128x128"), ("sr300", "640x480")):
        path = scene(sensor, "disks", 2.0 if quick else (10.0 if sensor == "paper" else 4.0))
        rates = []
        for _ in range(3):
            start = time.perf_counter()
            recording = Recording(path)
            pipeline = Pipeline(recording.station, recording.camera_infos, recording.encoder_joints, "refined")
            samples = sum(1 for _ in estimate_events(recording.events(), pipeline))
            rates.append(samples / (time.perf_counter() - start))
        results[size] = {"samples_per_s": round(sorted(rates)[1], 1), "samples": samples}
    return results
