"""One picture of a recording: what the cameras see, the angles beside the truth, and the error."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import RgbdFrame
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.angles import AngleSigns, Arm, clinical, euler_yxz, signs_of
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.extras import need_extra
from ghest_rt.messages.results import MarkerObservation, Status
from ghest_rt.recording.reader import Recording
from ghest_rt.studies.metrics import sample_error
from ghest_rt.studies.score import JudgedRun, Progress, run_with_truth
from ghest_rt.vision.station import Method

_COLORS = {"flexion": "#0072B2", "abduction": "#D55E00", "rotation": "#009E73"}  # Okabe-Ito, safe for colour-blind readers
_STATUS_COLORS = {Status.DEGRADED: "#F0E442", Status.LOST: "#CC79A7"}
_AXIS_RGB = ((230, 60, 40), (40, 170, 60), (40, 90, 220))


_LEAST_SAMPLES = 2


def draw_recording(path: Path, out: Path, method: Method | None = None, progress: Progress | None = None) -> None:
    """Draw a recording with truth to a PNG, SVG or PDF file.

    Raises:
        BadInputError: The recording cannot be used or is too short, or `out` cannot be written or has an ending that cannot be
            drawn.
        GhestError: Matplotlib is not installed.
    """
    if out.suffix.lower() not in {".png", ".svg", ".pdf"}:
        raise BadInputError(f"{out}: pictures end in .png, .svg or .pdf")
    need_extra("plots", "a picture")
    from matplotlib.figure import Figure  # noqa: PLC0415 - an extra, imported only when used

    run = run_with_truth(path, method, progress=progress)
    if len(run.estimates) < _LEAST_SAMPLES:
        raise BadInputError(
            f"{path}: too short for a picture, which takes {_LEAST_SAMPLES} samples: there is {len(run.estimates)}"
        )
    figure = Figure(figsize=(11.0, 8.2), layout="constrained")
    grid = figure.add_gridspec(3, 2, height_ratios=(1.5, 1.1, 0.7))
    for column, (camera, (image, found)) in enumerate(sorted(_annotated(run.recording, method).items())):
        axes = figure.add_subplot(grid[0, column])
        axes.imshow(image, interpolation="nearest")
        marker = run.recording.station.config.cameras[camera].marker
        axes.set_title(f"camera {camera}: marker {marker}{' with its estimated axes' if found else ' not found'}", fontsize=10)
        axes.set_axis_off()
    angles = figure.add_subplot(grid[1, :])
    _draw_angles(angles, run)
    _draw_error(figure.add_subplot(grid[2, :], sharex=angles), run)
    figure.suptitle(_title(run), fontsize=12)
    try:
        figure.savefig(out, dpi=130)
    except OSError as error:
        raise BadInputError(f"{out}: cannot be written: {error.strerror or error}") from error


def _title(run: JudgedRun) -> str:
    facts = run.recording.facts
    told = {"motion": "movement", "sensor": "sensor", "seed": "seed"}
    of_what = [f"{word} {facts[fact]}" for fact, word in told.items() if fact in facts]
    return ", ".join([f"{run.recording.path.name}: method {run.method}", *of_what])


def _annotated(recording: Recording, method: Method | None) -> dict[str, tuple[NDArray[np.uint8], bool]]:
    """Return each camera's image near the middle of the recording, at least 480 px high, and whether its marker was found.

    If it was, the marker's axes are drawn on the image.
    """
    pipeline = Pipeline(recording.station, recording.camera_infos, recording.encoder_joints, method)
    images: dict[str, tuple[NDArray[np.uint8], bool]] = {}
    for frame, observation in _middle_frames(recording, pipeline):
        scale = max(1, 480 // frame.color_rgb.shape[0])
        image = np.ascontiguousarray(np.kron(frame.color_rgb, np.ones((scale, scale, 1), np.uint8)))
        if observation.camera_from_marker is not None:
            side_m = recording.station.config.markers[observation.marker].half_spacing_m
            _draw_axes(image, frame, observation.camera_from_marker, side_m, scale)
        images[frame.info.name] = image, observation.camera_from_marker is not None
    return images


def _middle_frames(recording: Recording, pipeline: Pipeline) -> Iterator[tuple[RgbdFrame, MarkerObservation]]:
    middle_ns: int | None = None
    done: set[str] = set()
    for event in recording.events():
        if not isinstance(event, RgbdFrame) or event.info.name in done:
            continue
        if middle_ns is None:
            middle_ns = event.t_arrival_ns + recording.duration_ns // 2
        if event.t_arrival_ns >= middle_ns:
            done.add(event.info.name)
            yield event, pipeline.observe(event)
        if len(done) == len(pipeline.cameras):
            return


def _draw_axes(
    image: NDArray[np.uint8], frame: RgbdFrame, camera_from_marker: NDArray[np.float64], side_m: float, scale: int
) -> None:
    rotation_vector, _ = cv2.Rodrigues(camera_from_marker[:3, :3])
    points_m = np.vstack([np.zeros(3), side_m * np.eye(3)])
    intrinsics = frame.info.color
    pixels, _ = cv2.projectPoints(
        points_m, rotation_vector, camera_from_marker[:3, 3], intrinsics.matrix, np.array(intrinsics.distortion)
    )
    origin, *tips = [tuple(int(v) for v in np.round((p[0] + 0.5) * scale - 0.5)) for p in pixels]
    for tip, color in zip(tips, _AXIS_RGB, strict=True):
        cv2.arrowedLine(
            image, origin, tip, color, thickness=max(2, image.shape[0] // 200), line_type=cv2.LINE_AA, tipLength=0.15
        )


def _draw_angles(axes: Any, run: JudgedRun) -> None:
    config = run.recording.station.config
    arm, signs = config.station.arm, signs_of(config.joint)
    t_0_ns = run.estimates[0].t_sample_ns if run.estimates else 0
    estimated, true = [], []
    for estimate in run.estimates:
        seconds = (estimate.t_sample_ns - t_0_ns) * 1e-9
        truth = run.truth.at(estimate.t_sample_ns)
        estimated.append((seconds, *_angles_deg(estimate.gh_from_arm, arm, signs)))
        true.append((seconds, *_angles_deg(truth.gh_from_arm if truth is not None else None, arm, signs)))
    for column, (name, color) in enumerate(_COLORS.items(), start=1):
        axes.plot(*_columns(true, column), color="0.78", linewidth=4.5)
        axes.plot(*_columns(estimated, column), color=color, linewidth=1.2, label=name)
    axes.plot([], [], color="0.78", linewidth=4.5, label="truth")
    _shade_status(axes, run)
    axes.set_ylabel(f"{'GH' if config.joint.name == 'gh' else config.joint.name} angle (°)")
    axes.legend(ncols=6, fontsize=9, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    axes.tick_params(labelbottom=False)
    axes.grid(alpha=0.3)


def _shade_status(axes: Any, run: JudgedRun) -> None:
    """Shade the times at which samples are degraded or lost, each sample to the middle between its neighbours."""
    t_s = (np.array([estimate.t_sample_ns for estimate in run.estimates]) - run.estimates[0].t_sample_ns) * 1e-9
    edges = np.concatenate(([t_s[0]], (t_s[1:] + t_s[:-1]) / 2, [t_s[-1]]))
    for status, color in _STATUS_COLORS.items():
        there = np.array([estimate.status is status for estimate in run.estimates])
        bounds = np.flatnonzero(np.diff(np.concatenate(([False], there, [False]))))
        for first, last in bounds.reshape(-1, 2):
            axes.axvspan(edges[first], edges[last], color=color, alpha=0.35, linewidth=0)
        share = 100.0 * there.mean()
        axes.fill_between(
            [], [], color=color, alpha=0.35, label=f"{status} ({share:.1f} %)" if there.any() else f"{status}: none"
        )


def _angles_deg(gh_from_arm: NDArray[np.float64] | None, arm: Arm, signs: AngleSigns) -> tuple[float, float, float]:
    if gh_from_arm is None:
        return math.nan, math.nan, math.nan
    angles = clinical(euler_yxz(gh_from_arm), arm, signs)
    return math.degrees(angles.flexion_rad), math.degrees(angles.abduction_rad), math.degrees(angles.rotation_rad)


def _columns(rows: list[tuple[float, float, float, float]], column: int) -> tuple[list[float], list[float]]:
    return [row[0] for row in rows], [row[column] for row in rows]


def _draw_error(axes: Any, run: JudgedRun) -> None:
    t_0_ns = run.estimates[0].t_sample_ns if run.estimates else 0
    points = []
    for estimate in run.estimates:
        truth = run.truth.at(estimate.t_sample_ns)
        error = sample_error(estimate, truth) if truth is not None else None
        points.append(
            ((estimate.t_sample_ns - t_0_ns) * 1e-9, math.nan if error is None else math.degrees(error.orientation_rad))
        )
    axes.plot([s for s, _ in points], [e for _, e in points], color="0.2", linewidth=0.9)
    _shade_status(axes, run)
    axes.set_ylabel("orientation\nerror (°)")
    axes.set_xlabel("time (s)")
    axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
