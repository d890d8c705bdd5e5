"""Pose of one marker from one RGB-D frame: ours beside OpenCV's ArUco, on the same rendered scenes."""

import time
from collections.abc import Callable
from typing import Any

import cv2

from benchmarks.scenes import scene
from benchmarks.timing import summary_ms
from ghest_drivers.samples import RgbdFrame
from ghest_rt.recording.reader import Recording
from ghest_rt.vision.factory import Method, make_detector

_ROUNDS = 3


def _frames(path: Any) -> tuple[Recording, list[RgbdFrame]]:
    recording = Recording(path)
    frames = [event for event in recording.events() if isinstance(event, RgbdFrame)]
    return recording, frames


def _time_each(frames: list[RgbdFrame], pose: Callable[[RgbdFrame], Any]) -> list[float]:
    best = [float("inf")] * len(frames)
    for _ in range(_ROUNDS):
        for index, frame in enumerate(frames):
            start = time.perf_counter()
            pose(frame)
            best[index] = min(best[index], time.perf_counter() - start)
    return best


def _tuned_aruco() -> cv2.aruco.DetectorParameters:
    """ArUco set up for one large, near marker: a single threshold window, no tiny candidates."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.adaptiveThreshWinSizeMin = 23
    parameters.adaptiveThreshWinSizeMax = 23
    parameters.minMarkerPerimeterRate = 0.1
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    return parameters


def run(quick: bool) -> dict[str, Any]:
    """Time all on every frame of a 640x480 recording, then of one of 128x128; OpenCV keeps its own default threads."""
    small = {f"128x128: {name}": value for name, value in _timings("paper", quick).items()}
    return {**_timings("sr300", quick), **small}


def _timings(sensor: str, quick: bool) -> dict[str, Any]:
    duration_s = 1.0 if quick else 4.0
    disks, disk_frames = _frames(scene(sensor, "disks", duration_s))
    _, aruco_frames = _frames(scene(sensor, "aruco", duration_s))
    config = disks.station.config
    results: dict[str, Any] = {"frames": len(disk_frames)}

    def detectors(method: Method) -> dict[str, Any]:
        return {
            name: make_detector(method, name, camera.marker, config.markers[camera.marker], disks.camera_infos[name])
            for name, camera in config.cameras.items()
        }

    tracked = detectors("refined")
    results["refined, tracking"] = summary_ms(_time_each(disk_frames, lambda f: tracked[f.info.name].detect(f)))
    cold = detectors("refined")

    def from_scratch(frame: RgbdFrame) -> None:
        cold[frame.info.name].reset()
        cold[frame.info.name].detect(frame)

    results["refined, whole frame every time"] = summary_ms(_time_each(disk_frames, from_scratch))
    aligned = detectors("photometric")
    results["photometric, tracking"] = summary_ms(_time_each(disk_frames, lambda f: aligned[f.info.name].detect(f)))
    rival = detectors("aruco")
    results["ArUco, default parameters"] = summary_ms(_time_each(aruco_frames, lambda f: rival[f.info.name].detect(f)))
    tuned = detectors("aruco")
    for detector in tuned.values():
        detector.set_parameters(_tuned_aruco())
    results["ArUco, tuned"] = summary_ms(_time_each(aruco_frames, lambda f: tuned[f.info.name].detect(f)))
    default_ms = results["ArUco, default parameters"]["median_ms"]
    for name in ("refined, tracking", "photometric, tracking", "refined, whole frame every time"):
        results[f"ratio: ArUco default / {name}"] = round(default_ms / results[name]["median_ms"], 2)
        results[f"ratio: ArUco tuned / {name}"] = round(results["ArUco, tuned"]["median_ms"] / results[name]["median_ms"], 2)
    return results
