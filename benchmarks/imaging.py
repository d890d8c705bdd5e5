"""Every vision method on images with faults of lens, sensor and print: errors, and whether the covariance knows of them.

Frames of the simulated clinic (`ghest-rt simulate --image …`) in short bursts spread over the movement COMB, both cameras; the
last frame of each burst is scored against the truth.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.figure import Figure

from ghest_drivers.samples import CameraInfo, RgbdFrame
from ghest_rt.config.station import Marker
from ghest_rt.geometry.so3 import Array, log_so3
from ghest_rt.simulation.building import build_world
from ghest_rt.simulation.optics import parse_imaging
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.vision.factory import Method, make_detector

SensorName = Literal["paper", "sr300"]
Burst = tuple[CameraInfo, str, Marker, list[RgbdFrame], Array]

CASES: dict[str, tuple[str, ...]] = {
    "as planned": (),
    "Bayer": ("bayer",),
    "defocus 0.8 px": ("defocus:0.8",),
    "defocus 2 px": ("defocus:2",),
    "exposure 20 ms": ("motion-blur:0.02",),
    "k1 -0.08, told": ("distortion:-0.08",),
    "k1 +0.01, untold": ("untold-distortion:0.01",),
    "colours off by 12": ("wrong-color:12",),
    "gain 1.15": ("gain:1.15",),
    "gamma 1.2": ("gamma:1.2",),
    "several at once": ("bayer", "defocus:0.8", "wrong-color:12", "gamma:1.1", "motion-blur:0.015"),
}
SENSORS: tuple[SensorName, ...] = ("paper", "sr300")
METHODS: tuple[Method, ...] = ("paper", "aruco", "refined", "photometric")
_STYLES = {"paper": ("#D55E00", "s"), "aruco": ("#CC79A7", "^"), "refined": ("#0072B2", "o"), "photometric": ("#56B4E9", "D")}
_OUT = Path(__file__).resolve().parents[1] / "out" / "benchmarks" / "imaging.png"
_FRAMES_PER_BURST = 3
_SEED = 11


def bursts(
    sensor: SensorName,
    texts: tuple[str, ...],
    marker: Literal["disks", "aruco"],
    count: int,
    duration_s: float | None = None,
) -> Iterator[Burst]:
    """Yield camera, marker's name, marker, frames and the true pose (4, 4) in the last of them, `count` times per camera.

    Args:
        sensor: The sensor simulated.
        texts: Faults of the images, as `ghest-rt simulate --image` takes them.
        marker: The marker's texture.
        count: Bursts per camera, evenly spread.
        duration_s: How much of the movement they are spread over; None for all of it.
    """
    options = SimulateOptions(
        out=_OUT,
        movement="COMB",
        sensor=sensor,
        seed=_SEED,
        duration_s=duration_s,
        marker=marker,
        imaging=parse_imaging(texts),
    )
    world = build_world(options)
    config = world.station.config
    for name, camera in config.cameras.items():
        for first in np.linspace(0, world.frame_count(name) - _FRAMES_PER_BURST, count).astype(int).tolist():
            numbers = range(first, first + _FRAMES_PER_BURST)
            frames = [frame for k in numbers if (frame := world.frame(name, k)) is not None]
            pose = world.camera_from_marker(name, world.frame_times(name, numbers[-1]).color_ns)
            yield world.camera_info(name), camera.marker, config.markers[camera.marker], frames, pose


def errors(method: Method, given: list[Burst]) -> tuple[Array, list[float]]:
    """Return (n, 2) errors in degrees and millimetres of the markers found, and their squared errors over their covariances."""
    found, nees = [], []
    for info, name, marker, frames, pose in given:
        detector = make_detector(method, info.name, name, marker, info)
        seen = [detector.detect(frame) for frame in frames][-1]
        if seen.camera_from_marker is None:
            continue
        error = np.concatenate(
            [log_so3(pose[:3, :3] @ seen.camera_from_marker[:3, :3].T), pose[:3, 3] - seen.camera_from_marker[:3, 3]]
        )
        found.append((np.rad2deg(np.linalg.norm(error[:3])), 1e3 * np.linalg.norm(error[3:])))
        if seen.covariance is not None:
            nees.append(float(error @ np.linalg.solve(seen.covariance, error)))
    return np.array(found).reshape(-1, 2), nees


def run(quick: bool) -> dict[str, Any]:
    """Return RMS degrees and millimetres and mean NEES per sensor, fault and method; draw out/benchmarks/imaging.png."""
    count = 4 if quick else 30
    results: dict[str, Any] = {"poses per cell": 2 * count}
    found: dict[str, dict[str, list[Array]]] = {}
    for sensor in SENSORS:
        rms: dict[str, list[Array]] = {method: [] for method in METHODS}
        for case, texts in CASES.items():
            scenes = {code: list(bursts(sensor, texts, code, count)) for code in ("disks", "aruco")}
            line: dict[str, str] = {}
            for method in METHODS:
                given = scenes["aruco" if method == "aruco" else "disks"]
                seen, nees = errors(method, given)
                rms[method].append(np.sqrt(np.mean(seen**2, axis=0)) if len(seen) else np.full(2, np.nan))
                line[method] = "{:.4f}° {:.4f} mm".format(*rms[method][-1])
                line[method] += f", NEES {np.mean(nees):.1f}" if nees else ""
                line[method] += f", {len(given) - len(seen)} not found" if len(seen) < len(given) else ""
            results[f"{sensor}, {case}"] = line
        found[sensor] = rms
    _OUT.parent.mkdir(parents=True, exist_ok=True)
    draw(found, _OUT)
    return results


def draw(found: Mapping[str, Mapping[str, Sequence[Array]]], out: Path) -> None:
    """Draw the RMS errors (degrees, millimetres) of every sensor and method, case by case; sensors share an axis.

    Args:
        found: By sensor and method a pair for every case.
        out: The picture.
    """
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    axes = figure.subplots(2, len(found), sharex=True, sharey="row")
    for column, (sensor, rms) in enumerate(found.items()):
        for row, label in enumerate(("orientation RMS (°)", "position RMS (mm)")):
            axis = axes[row][column]
            for beside, (method, pairs) in zip((0.0, 0.0, -0.12, 0.12), rms.items(), strict=True):
                color, symbol = _STYLES[method]
                places = np.arange(len(pairs)) + beside
                axis.plot(places, [pair[row] for pair in pairs], symbol, color=color, markersize=5.5, label=method)
            axis.set_yscale("log")
            axis.yaxis.set_major_formatter("{x:g}")
            axis.set_xticks(np.arange(len(CASES)), list(CASES), rotation=40, ha="right", fontsize=8)
            axis.grid(alpha=0.3)
            if column == 0:
                axis.set_ylabel(label)
        axes[0][column].set_title(f"{sensor} sensor")
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=len(METHODS), fontsize=9)
    figure.savefig(out, dpi=120)
