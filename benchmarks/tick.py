"""A whole tick for two 128x128 cameras: vision of both frames, composition, estimate and message, on one core."""

import time
from typing import Any

import cv2

from benchmarks.scenes import scene
from benchmarks.timing import summary_ms
from ghest_drivers.samples import EncoderSample, RgbdFrame
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.recording.reader import Recording
from ghest_rt.vision.station import Method


def run(quick: bool) -> dict[str, Any]:
    """Time everything that happens between two ticks, per method."""
    cv2.setNumThreads(1)
    recording = Recording(scene("paper", "disks", 2.0 if quick else 10.0))
    events = [event for event in recording.events() if isinstance(event, RgbdFrame | EncoderSample)]
    methods: tuple[Method, ...] = ("paper", "refined")
    return {method: summary_ms(_ticks(recording, events, method)) for method in methods}


def _ticks(recording: Recording, events: list[RgbdFrame | EncoderSample], method: Method) -> list[float]:
    pipeline = Pipeline(recording.station, recording.camera_infos, recording.encoder_joints, method)
    seconds: list[float] = []
    spent = 0.0
    captured: list[int] = []
    for event in events:
        start = time.perf_counter()
        pipeline.add(pipeline.observe(event) if isinstance(event, RgbdFrame) else event)
        if isinstance(event, RgbdFrame):
            captured.append(event.t_capture_ns)
        tick_done = isinstance(event, RgbdFrame) and event.info.name == "r1"
        if tick_done and len(captured) > 10:
            pipeline.estimate(captured[-9])
        spent += time.perf_counter() - start
        if tick_done:
            seconds.append(spent)
            spent = 0.0
    return seconds[20:]
