"""A small renderer of one marker in front of one RGB-D camera, independent of the simulated clinic.

Colour by supersampling (an exact box filter as the number of samples grows), depth exactly at pixel centres, both through the
lens model; the depth camera may stand elsewhere. Everything random comes from the generator passed in.
"""

from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame
from ghest_rt.config.station import Marker
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3

MARKER = Marker(
    half_spacing_m=0.018,
    disk_radius_m=0.008,
    plate_m=0.060,
    disk_rgb=((214, 40, 57), (124, 181, 24), (0, 158, 165), (122, 62, 180)),
)
PLATE_RGB = (238.0, 238.0, 236.0)
_SIGNS = np.array([[1, -1], [-1, -1], [1, 1], [-1, 1]])


def pinhole(width, height, focal, distortion=(0.0,) * 5):
    return Intrinsics(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2, distortion)


def paper_camera(unit_m=1e-5):
    intrinsics = pinhole(128, 128, 64 / np.tan(np.deg2rad(22.5)))
    return CameraInfo("r0", "paper", "0", intrinsics, intrinsics, unit_m, np.eye(4), 66.6)


def sr300_camera(distortion=(0.0,) * 5, baseline_m=0.025):
    color_from_depth = transform(exp_so3(np.array([0.004, -0.006, 0.002])), [-baseline_m, 0.0005, 0.001])
    return CameraInfo(
        "r0", "sr300", "0", pinhole(640, 480, 475.0, distortion), pinhole(640, 480, 475.0), 0.125e-3, color_from_depth, 60.0
    )


@dataclass(frozen=True)
class Blob:
    """A flat disk facing the camera: an occluder in front of the plate, or a distractor beside it."""

    center_m: tuple[float, float, float]  # camera frame
    radius_m: float
    rgb: tuple[float, float, float]


@dataclass(frozen=True)
class Scene:
    """What to render; `gains` are brightness and white balance per channel."""

    pose: np.ndarray
    gains: tuple[float, float, float] = (1.0, 1.0, 1.0)
    color_noise: float = 0.0
    depth_noise_m: float = 0.0
    shading: tuple[float, float] = (0.0, 0.0)  # relative change of brightness over the plate's side, along x and y
    background_rgb: tuple[float, float, float] = (118.0, 96.0, 84.0)
    background_m: float = 0.45
    blobs: tuple[Blob, ...] = ()
    depth_pose: np.ndarray | None = None  # pose of the marker at the depth image's time
    textured: bool = True
    code: int | None = None  # draw this ArUco code of DICT_4X4_50 instead of the disks
    marker: Marker = field(default_factory=lambda: MARKER)


def _rays(intrinsics, pixels):
    focal = np.array([intrinsics.fx_px, intrinsics.fy_px])
    if any(intrinsics.distortion):
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 1e-9)
        flat = cv2.undistortPointsIter(
            pixels.reshape(-1, 1, 2), intrinsics.matrix, np.array(intrinsics.distortion), np.eye(3), np.eye(3), criteria
        )
        return flat.reshape(pixels.shape)
    return (pixels - (intrinsics.cx_px, intrinsics.cy_px)) / focal


def _plate_point(pose, rays):
    """Intersect rays with the plate: coordinates in the plate and depth."""
    n, p = pose[:3, 2], pose[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (n @ p) / (rays @ n[:2] + n[2])
    points = np.concatenate([rays, np.ones((*rays.shape[:-1], 1))], axis=-1) * z[..., None] - p
    return points @ pose[:3, 0], points @ pose[:3, 1], z


def _color(scene, rays):
    marker = scene.marker
    x, y, z = _plate_point(scene.pose, rays)
    rgb = np.empty((*rays.shape[:-1], 3))
    rgb[:] = scene.background_rgb
    if scene.textured:
        rgb *= (1.0 + 0.25 * np.sin(19 * rays[..., 0] + 1.0) * np.cos(23 * rays[..., 1]))[..., None]
    nearest = np.full(z.shape, scene.background_m)
    on_plate = (np.abs(x) < marker.plate_m / 2) & (np.abs(y) < marker.plate_m / 2) & (z > 0)
    shade = 1.0 + (scene.shading[0] * x + scene.shading[1] * y) / marker.plate_m
    surface = np.where(on_plate[..., None], np.array(PLATE_RGB), rgb)
    if scene.code is None:
        for sign, disk in zip(_SIGNS, marker.disk_rgb, strict=True):
            cx, cy = sign * marker.half_spacing_m
            on_disk = on_plate & ((x - cx) ** 2 + (y - cy) ** 2 < marker.disk_radius_m**2)
            surface[on_disk] = disk
    else:
        cells = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50).generateImageMarker(scene.code, 6)
        cell_m = (marker.half_spacing_m + marker.disk_radius_m) / 3
        on_code = on_plate & (np.abs(x) < 3 * cell_m) & (np.abs(y) < 3 * cell_m)
        column = np.clip(np.floor(x / cell_m + 3), 0, 5).astype(int)
        row = np.clip(np.floor(3 - y / cell_m), 0, 5).astype(int)  # the code's first row is at +y
        surface = np.where((on_code & (cells[row, column] == 0))[..., None], 12.0, surface)
    rgb = np.where(on_plate[..., None], surface * shade[..., None], rgb)
    nearest = np.where(on_plate, z, nearest)
    for blob in scene.blobs:
        bx, by, bz = blob.center_m
        hit = ((rays[..., 0] * bz - bx) ** 2 + (rays[..., 1] * bz - by) ** 2 < blob.radius_m**2) & (bz < nearest)
        rgb[hit] = blob.rgb
        nearest = np.where(hit, bz, nearest)
    return rgb


def render_color(scene, intrinsics, rng, samples=8):
    """(H, W, 3) uint8; supersampled where the marker or a blob is."""
    u, v = np.meshgrid(np.arange(intrinsics.width_px, dtype=float), np.arange(intrinsics.height_px, dtype=float))
    pixels = np.stack([u, v], axis=-1)
    image = _color(scene, _rays(intrinsics, pixels))
    left, top, right, bottom = _interesting(scene, intrinsics)
    if right > left and bottom > top:
        offsets = (np.arange(samples) + 0.5) / samples - 0.5
        rows = (np.arange(top, bottom)[:, None] + offsets).ravel()
        columns = (np.arange(left, right)[:, None] + offsets).ravel()
        fine = np.stack(np.meshgrid(columns, rows), axis=-1)
        shaded = _color(scene, _rays(intrinsics, fine))
        image[top:bottom, left:right] = shaded.reshape(bottom - top, samples, right - left, samples, 3).mean(axis=(1, 3))
    image = image * scene.gains
    if scene.color_noise:
        image = image + rng.normal(0.0, scene.color_noise, image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def _interesting(scene, intrinsics):
    half = scene.marker.plate_m / 2
    corners = [(x, y, 0.0, 1.0) for x in (-half, half) for y in (-half, half)]
    points = [*(scene.pose @ corners[k] for k in range(4))]
    spots = [point[:3] for point in points]
    for blob in scene.blobs:
        spots += [np.add(blob.center_m, (dx * blob.radius_m, dy * blob.radius_m, 0)) for dx in (-1, 1) for dy in (-1, 1)]
    pixels, _ = cv2.projectPoints(np.array(spots), np.zeros(3), np.zeros(3), intrinsics.matrix, np.array(intrinsics.distortion))
    low = np.floor(pixels.reshape(-1, 2).min(axis=0)).astype(int) - 2
    high = np.ceil(pixels.reshape(-1, 2).max(axis=0)).astype(int) + 3
    size = (intrinsics.width_px, intrinsics.height_px)
    return (*np.clip(low, 0, size), *np.clip(high, 0, size))


def render_depth(scene, info, rng):
    """(h, w) uint16, as the depth camera sees it; ray by ray at pixel centres."""
    intrinsics = info.depth
    depth_from_color = np.linalg.inv(info.color_from_depth)
    pose = depth_from_color @ (scene.pose if scene.depth_pose is None else scene.depth_pose)
    u, v = np.meshgrid(np.arange(intrinsics.width_px, dtype=float), np.arange(intrinsics.height_px, dtype=float))
    rays = _rays(intrinsics, np.stack([u, v], axis=-1))
    x, y, z = _plate_point(pose, rays)
    half = scene.marker.plate_m / 2
    depth = np.where((np.abs(x) < half) & (np.abs(y) < half) & (z > 0), z, scene.background_m)
    for blob in scene.blobs:
        bx, by, bz = (depth_from_color @ (*blob.center_m, 1.0))[:3]
        hit = (rays[..., 0] * bz - bx) ** 2 + (rays[..., 1] * bz - by) ** 2 < blob.radius_m**2
        depth = np.where(hit & (bz < depth), bz, depth)
    if scene.depth_noise_m:
        depth = depth + rng.normal(0.0, scene.depth_noise_m, depth.shape)
    return np.clip(np.rint(depth / info.depth_unit_m), 0, 65535).astype(np.uint16)


def render(scene, info, rng=None, *, seq=0, t_ns=0, with_depth=True, t_depth_ns=None, samples=8):
    """One frame of the scene."""
    rng = rng or np.random.default_rng(0)
    color = render_color(scene, info.color, rng, samples)
    depth = render_depth(scene, info, rng) if with_depth else None
    return RgbdFrame(info, seq, color, depth, t_ns, t_ns, t_ns, t_ns if t_depth_ns is None else t_depth_ns)


def facing_pose(tilt_rad, azimuth_rad, roll_rad, position_m):
    """Marker pose tilted away from facing the camera by `tilt_rad`; at zero its x is to the right and y up in the image."""
    facing = np.diag([1.0, -1.0, -1.0])
    axis = np.array([np.cos(azimuth_rad), np.sin(azimuth_rad), 0.0])
    return transform(exp_so3(tilt_rad * axis) @ facing @ exp_so3(np.array([0.0, 0.0, roll_rad])), position_m)


def random_pose(rng, distance_m=(0.16, 0.20), max_tilt_deg=40.0, lateral_m=0.02):
    tilt = np.deg2rad(max_tilt_deg) * np.sqrt(rng.uniform())
    position = [*rng.uniform(-lateral_m, lateral_m, 2), rng.uniform(*distance_m)]
    return facing_pose(tilt, rng.uniform(0, 2 * np.pi), rng.uniform(0, 2 * np.pi), position)


def pose_error(estimate, truth):
    """(degrees, millimetres)."""
    difference = estimate[:3, :3] @ truth[:3, :3].T
    angle = np.linalg.norm(cv2.Rodrigues(difference)[0])
    return float(np.rad2deg(angle)), float(1e3 * np.linalg.norm(estimate[:3, 3] - truth[:3, 3]))


def error_vector(estimate, truth):
    """(6,) rotation error then translation error, as the covariance of an observation means them."""
    rotation = cv2.Rodrigues(truth[:3, :3] @ estimate[:3, :3].T)[0].ravel()
    return np.concatenate([rotation, truth[:3, 3] - estimate[:3, 3]])


def moved(scene, **changes):
    return replace(scene, **changes)
