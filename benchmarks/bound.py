"""Every vision method beside the Cramér-Rao bound of a single frame, over distance and tilt.

The bound is computed from the scene alone, by line integrals around the ellipses; the frames are rendered by the tests' own
renderer. Neither shares code with the methods.
"""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ghest_drivers.samples import CameraInfo
from ghest_rt.vision.factory import Method, make_detector
from tests.vision.scenes import (
    MARKER,
    PLATE_RGB,
    Scene,
    facing_pose,
    paper_camera,
    pose_error,
    render,
    sr300_camera,
)

_OUT = Path(__file__).resolve().parents[1] / "out" / "benchmarks" / "bound.png"
_COLOR_NOISE = 4.0  # of 255
_DEPTH_NOISE_M = 0.0005
_SENSORS = {"paper": (paper_camera(), (0.14, 0.18, 0.24)), "sr300": (sr300_camera(), (0.22, 0.28, 0.36))}
_TILTS_DEG = (5.0, 20.0, 40.0)
_METHODS: tuple[Method, ...] = ("paper", "aruco", "refined", "photometric")
_STYLES = {"paper": "#999999", "aruco": "#D55E00", "refined": "#56B4E9", "photometric": "#0072B2"}
_ARC_POINTS = 180


def bound(info: CameraInfo, pose: np.ndarray) -> tuple[float, float]:
    """Return the least RMS errors (degrees, millimetres) of any unbiased pose from one frame.

    Colour: every unit length of edge says (|v| / sigma)^2 c(t) about the edge's place along its normal, v being the step of
    colour and c(t) the integral of the squared slope of a box-shaped pixel's edge in direction t. Depth: every pixel on the
    plate says 1 / sigma^2 about its distance. Colours, light and sharpness are taken as known.
    """
    R, p = pose[:3, :3], pose[:3, 3]
    fx, fy = info.color.fx_px, info.color.fy_px
    information = np.zeros((6, 6))
    angles = np.linspace(0.0, 2.0 * np.pi, _ARC_POINTS, endpoint=False)
    signs = ((1, -1), (-1, -1), (1, 1), (-1, 1))
    for (sx, sy), rgb in zip(signs, MARKER.disk_rgb, strict=True):
        step2 = float(np.sum((np.array(PLATE_RGB) - rgb) ** 2))
        ring = MARKER.disk_radius_m * np.stack([np.cos(angles), np.sin(angles), np.zeros(_ARC_POINTS)], axis=1)
        q = (ring + np.array([sx, sy, 0.0]) * MARKER.half_spacing_m) @ R.T
        x, y, z = (q + p).T
        pixels = np.stack([fx * x / z, fy * y / z], axis=1)
        along = (np.roll(pixels, -1, axis=0) - np.roll(pixels, 1, axis=0)) / 2.0
        length_px = np.linalg.norm(along, axis=1)
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1) / length_px[:, None]
        g = np.stack(
            [normal[:, 0] * fx / z, normal[:, 1] * fy / z, -(normal[:, 0] * fx * x + normal[:, 1] * fy * y) / z**2], axis=1
        )
        J = np.concatenate([np.cross(q, g), g], axis=1)
        wide = np.abs(normal).max(axis=1)
        sharp = (1.0 - np.abs(normal).min(axis=1) / (3.0 * wide)) / wide
        information += (J * (length_px * sharp * step2 / _COLOR_NOISE**2)[:, None]).T @ J
    information += _depth_information(info, pose)
    variances = np.diag(np.linalg.inv(information))
    return float(np.rad2deg(np.sqrt(variances[:3].sum()))), float(1e3 * np.sqrt(variances[3:].sum()))


def _depth_information(info: CameraInfo, color_pose: np.ndarray) -> np.ndarray:
    """Return (6, 6) what depth says about the pose in the colour camera's frame."""
    T = np.linalg.inv(info.color_from_depth)
    R, p = (T @ color_pose)[:3, :3], (T @ color_pose)[:3, 3]
    width, height = info.depth.width_px, info.depth.height_px
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    rays = np.stack(
        [(u - info.depth.cx_px) / info.depth.fx_px, (v - info.depth.cy_px) / info.depth.fy_px, np.ones(u.shape)], axis=-1
    )
    n = R[:, 2]
    slant = rays @ n
    q = rays * ((n @ p) / slant)[..., None] - p
    on_plate = (np.abs(q @ R[:, :2]) < MARKER.plate_m / 2).all(axis=-1)
    q, slant = q[on_plate], slant[on_plate]
    # A plane that moves by w x q + t is met farther away by n . (w x q + t) / (n . ray).
    J = np.concatenate([np.cross(q, n), np.broadcast_to(n, q.shape)], axis=1) / slant[:, None]
    J[:, :3] = J[:, :3] @ T[:3, :3]
    J[:, 3:] = J[:, 3:] @ T[:3, :3]
    return np.asarray(J.T @ J / (_DEPTH_NOISE_M**2 + info.depth_unit_m**2 / 12.0))


def _errors(info: CameraInfo, poses: list[np.ndarray], method: Method, rng: np.random.Generator) -> tuple[float, float] | None:
    """Return the RMS errors (degrees, millimetres) at first sight; None if some pose was not found."""
    code = 0 if method == "aruco" else None
    errors = []
    for pose in poses:
        scene = Scene(pose, color_noise=_COLOR_NOISE, depth_noise_m=_DEPTH_NOISE_M, code=code)
        frame = render(scene, info, rng, samples=8)
        seen = make_detector(method, "r0", "m0", MARKER, info).detect(frame)
        if seen.camera_from_marker is None:
            return None
        errors.append(pose_error(seen.camera_from_marker, pose))
    rotation_deg, position_mm = np.sqrt(np.mean(np.square(errors), axis=0))
    return float(rotation_deg), float(position_mm)


def run(quick: bool) -> dict[str, Any]:
    """Return RMS degrees and millimetres of bound and methods per sensor, distance and tilt; draw out/benchmarks/bound.png."""
    results: dict[str, Any] = {"colour noise (of 255)": _COLOR_NOISE, "depth noise (mm)": 1e3 * _DEPTH_NOISE_M}
    count = 3 if quick else 8
    figure = Figure(figsize=(11.0, 6.4), layout="constrained")
    axes = figure.subplots(len(_SENSORS), len(_TILTS_DEG), sharey=True)
    ratios: dict[str, list[float]] = {sensor: [] for sensor in _SENSORS}
    for row, (sensor, (info, distances_m)) in enumerate(_SENSORS.items()):
        for column, tilt_deg in enumerate(_TILTS_DEG):
            curves: dict[str, list[float]] = {"bound": [], **{method: [] for method in _METHODS}}
            for distance_m in distances_m:
                rng = np.random.default_rng(7)
                poses = [
                    facing_pose(
                        np.deg2rad(tilt_deg),
                        *rng.uniform(0.0, 2.0 * np.pi, 2),
                        [*(distance_m * rng.uniform(-0.05, 0.05, 2)), distance_m],
                    )
                    for _ in range(count)
                ]
                least = np.sqrt(np.mean(np.square([bound(info, pose) for pose in poses]), axis=0))
                line: dict[str, Any] = {"bound": _text(*least)}
                curves["bound"].append(float(least[0]))
                for method in _METHODS:
                    found = _errors(info, poses, method, rng)
                    line[method] = "not found in every frame" if found is None else _text(*found)
                    curves[method].append(np.nan if found is None else found[0])
                ratios[sensor].append(curves["photometric"][-1] / curves["bound"][-1])
                results[f"{sensor}, {distance_m:.2f} m, tilt {tilt_deg:.0f}°"] = line
            _draw(axes[row][column], distances_m, curves, f"{sensor} sensor, tilt {tilt_deg:.0f}°")
    for sensor, values in ratios.items():
        results[f"photometric / bound, orientation, {sensor}: mean and greatest"] = (
            f"{np.mean(values):.2f}, {np.max(values):.2f}"
        )
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside upper center", ncols=5, fontsize=9)
    _OUT.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(_OUT, dpi=120)
    return results


def _text(rotation_deg: float, position_mm: float) -> str:
    return f"{rotation_deg:.4f}° {position_mm:.4f} mm"


def _draw(axis: Any, distances_m: tuple[float, ...], curves: dict[str, list[float]], title: str) -> None:
    for name, values in curves.items():
        axis.plot(
            distances_m, values, "--" if name == "bound" else "o-", color=_STYLES.get(name, "black"), label=name, markersize=4
        )
    axis.set_yscale("log")
    axis.set_title(title, fontsize=9)
    axis.set_xlabel("distance (m)")
    axis.set_ylabel("orientation RMS (°)")
