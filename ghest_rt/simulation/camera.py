"""A simulated RGB-D camera: frames of the moving clinic, each depending on seed and frame number alone."""

from dataclasses import dataclass
from typing import TypeVar

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import CameraInfo, RgbdFrame
from ghest_rt.config.station import Marker
from ghest_rt.geometry.se3 import inverse
from ghest_rt.geometry.so3 import Array
from ghest_rt.simulation.imaging import ColorSensor, DepthSensor, Light
from ghest_rt.simulation.optics import Float32, Imaging, aperture_px
from ghest_rt.simulation.plate import PlateShader
from ghest_rt.simulation.rays import PixelRays, Region
from ghest_rt.simulation.sensors import CameraProfile
from ghest_rt.simulation.stage import Stage
from ghest_rt.simulation.texture import Texture
from ghest_rt.simulation.timeline import Timeline
from ghest_rt.simulation.tracing import Hits, Tracer, shade

_REGION_MARGIN_PX = 6.0
_BLURRED_SUPERSAMPLING = 4  # where every point of the circle of confusion adds its own samples

_Colors = TypeVar("_Colors", Float32, Array)


@dataclass(frozen=True, slots=True)
class FrameTimes:
    """When one frame happens, nanoseconds of the recording.

    Attributes:
        color_ns: True mid-exposure of the colour image.
        depth_ns: True mid-exposure of the depth image.
        stamp_error_ns: Error of the capture times that the camera reports.
        arrival_ns: Delivery.
        device_ns: The camera's own clock at the colour image's mid-exposure.
    """

    color_ns: int
    depth_ns: int
    stamp_error_ns: int
    arrival_ns: int
    device_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class _Picture:
    """An ideal image: background traced on a coarse grid, the marker's surroundings at full resolution."""

    colors: Float32 | None
    z_m: Array
    facing: Array | None


class SimulatedCamera:
    """One camera. Not for two threads at once: each camera has its own working memory.

    Args:
        clinic: The moving scene.
        name: The camera's name in the station file.
        marker_name: The marker it looks at.
        marker: That marker's geometry.
        texture: What is printed on it.
        profile: What kind of camera it is.
        light: The light in the room.
        imaging: What goes wrong with the colour images.
        timeline: Where the movement is in the recording.
        seed: Seeds noise, phase and jitter, with the camera's name.
    """

    def __init__(
        self,
        clinic: Stage,
        name: str,
        *,
        marker_name: str,
        marker: Marker,
        texture: Texture,
        profile: CameraProfile,
        light: Light,
        imaging: Imaging,
        timeline: Timeline,
        seed: int,
    ) -> None:
        profile = imaging.profile(profile)
        self.info: CameraInfo = profile.info(name)
        self._clinic = clinic
        self._marker_name = marker_name
        self._profile = profile
        self._timeline = timeline
        self._seed = (seed, *name.encode())
        rng = np.random.default_rng(self._seed)
        self._phase_s = 0.0 if profile.synchronous else float(rng.uniform(0.0, 1.0 / profile.rate_hz))
        self._device_offset_ns = 0 if profile.synchronous else int(rng.integers(0, 10**9))
        self._color_sensor = ColorSensor(profile, light, imaging, rng)
        self._depth_sensor = DepthSensor(profile, rng)
        self._color_rays = PixelRays(imaging.lens(profile.color))
        self._depth_rays = self._color_rays if profile.depth_is_registered else PixelRays(profile.depth)
        supersampling = min(profile.supersampling, _BLURRED_SUPERSAMPLING) if imaging.defocus_px else profile.supersampling
        self._shader = PlateShader(texture, marker.plate_m, supersampling, aperture_px(imaging.defocus_px))
        self._defocus_px = imaging.defocus_px
        self._tracer = Tracer(clinic.model, marker_name)
        self._data = mujoco.MjData(clinic.model)

    @property
    def frame_count(self) -> int:
        """How many frames the movement has."""
        return int(np.ceil((self._timeline.duration_s - self._phase_s) * self._profile.rate_hz - 1e-6))

    def times(self, k: int) -> FrameTimes:
        """Return when frame `k` happens."""
        p = self._profile
        if p.synchronous:
            color_ns = self._timeline.grid_ns(k)
        else:
            color_ns = self._timeline.start_ns + round((self._phase_s + k / p.rate_hz) * 1e9)
        stamp, late = np.random.default_rng((*self._seed, 1, k)).standard_normal(2)
        device_s = (color_ns - self._timeline.start_ns) * (1.0 + p.clock_drift)
        return FrameTimes(
            color_ns=color_ns,
            depth_ns=color_ns + round(p.depth_delay_s * 1e9),
            stamp_error_ns=round(p.stamp_jitter_s * stamp * 1e9),
            arrival_ns=color_ns + round((p.latency_s + p.latency_jitter_s * max(-2.0, min(2.0, late))) * 1e9),
            device_ns=self._timeline.start_ns + self._device_offset_ns + round(device_s),
        )

    def frame(self, k: int) -> RgbdFrame:
        """Return frame `k`."""
        times = self.times(k)
        color, depth = self.images(times.color_ns, times.depth_ns, np.random.default_rng((*self._seed, 2, k)))
        return RgbdFrame(
            info=self.info,
            seq=k,
            color_rgb=color,
            depth_counts=depth,
            t_device_ns=times.device_ns,
            t_arrival_ns=times.arrival_ns,
            t_capture_ns=times.color_ns + times.stamp_error_ns,
            t_depth_capture_ns=times.depth_ns + times.stamp_error_ns,
        )

    def images(self, color_ns: int, depth_ns: int, rng: np.random.Generator) -> tuple[NDArray[np.uint8], NDArray[np.uint16]]:
        """Return colour and depth image as exposed around the given instants."""
        p = self._profile
        t_s = self._timeline.movement_s(color_ns)
        # The middle of the exposure comes last: its scene is what the rays are cast into.
        offsets = (np.arange(p.sub_exposures) + 0.5) / p.sub_exposures - 0.5
        instants = [t_s + p.exposure_s * float(o) for o in offsets]
        poses = [self._camera_from_marker(t) for t in instants]
        e_from_camera = self._place(t_s)
        picture = self._picture(e_from_camera, self._color_rays, poses, self._camera_from_marker(t_s), colored=True)
        if picture.colors is None:
            raise ValueError("a colour picture was asked for")
        color = self._color_sensor.expose(picture.colors, t_s, rng)
        if not p.depth_is_registered:
            depth_s = self._timeline.movement_s(depth_ns)
            e_from_depth = self._place(depth_s) @ self.info.color_from_depth
            depth_from_marker = inverse(self.info.color_from_depth) @ self._camera_from_marker(depth_s)
            picture = self._picture(e_from_depth, self._depth_rays, [], depth_from_marker, colored=False)
        return color, self._depth_sensor.measure(picture.z_m, picture.facing, rng)

    def _place(self, t_s: float) -> Array:
        self._clinic.place(self._data, t_s)
        return self._clinic.e_from_camera(self._data, self.info.name)

    def _camera_from_marker(self, t_s: float) -> Array:
        e_from_camera = self._place(t_s)
        return inverse(e_from_camera) @ self._clinic.e_from_marker(self._data, self._marker_name)

    def _picture(
        self, e_from_camera: Array, rays: PixelRays, exposures: list[Array], camera_from_marker: Array, colored: bool
    ) -> _Picture:
        """Trace the scene as `data` holds it; draw the plate at each of `exposures` and average."""
        step = self._profile.background_step_px
        height, width = rays.x.shape
        grid = (slice(step // 2, None, step), slice(step // 2, None, step))
        small = rays.x[grid].shape
        hits = self._cast(e_from_camera, rays, *grid)
        colors = None
        if colored:
            coarse = self._tracer.colors(hits).reshape(*small, 3).astype(np.float32)
            whole = np.asarray(cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR), dtype=np.float32)
            colors = self._defocused(whole)
        z = _enlarge(hits.z_m.reshape(small), step, height, width)
        wants_facing = self._profile.depth_holes and not (colored and not self._profile.depth_is_registered)
        facing = (
            _enlarge(_facing(hits, e_from_camera, rays, *grid).reshape(small), step, height, width) if wants_facing else None
        )
        region = self._region(rays, exposures or [camera_from_marker], camera_from_marker)
        if region.empty:
            return _Picture(colors, z, facing)
        near = self._cast(e_from_camera, rays, *region.slices)
        shape = (region.v1 - region.v0, region.u1 - region.u0)
        behind_m = near.z_m.reshape(shape)
        cover = self._shader.cover(rays, region, camera_from_marker)
        unhidden = cover.z_m < behind_m
        z[region.slices] = np.where(cover.inside & unhidden, cover.z_m, behind_m)
        normal = (e_from_camera[:3, :3] @ camera_from_marker[:3, :3])[:, 2]
        if facing is not None:
            plate = _facing_of(np.broadcast_to(normal, (near.geom.size, 3)), e_from_camera, rays, *region.slices).reshape(shape)
            rest = _facing(near, e_from_camera, rays, *region.slices).reshape(shape)
            facing[region.slices] = np.where(cover.inside & unhidden, plate, rest)
        if colors is not None:
            background = self._defocused(self._tracer.colors(near).reshape(*shape, 3))
            brightness = float(shade(normal[None])[0])
            drawn = [self._shader.draw(rays, region, pose, background, brightness) for pose in exposures]
            colors[region.slices] = np.where(unhidden[..., None], np.mean(drawn, axis=0), background)
        return _Picture(colors, z, facing)

    def _defocused(self, background: _Colors) -> _Colors:
        if not self._defocus_px:
            return background
        # As wide as the circle of confusion, whose variance along an axis is a quarter of its squared radius.
        cv2.GaussianBlur(background, (0, 0), self._defocus_px / 2, dst=background)
        return background

    def _cast(self, e_from_camera: Array, rays: PixelRays, rows: slice, columns: slice) -> Hits:
        return self._tracer.cast(self._data, e_from_camera, rays.directions(rows, columns))

    def _region(self, rays: PixelRays, poses: list[Array], middle: Array) -> Region:
        corners = np.vstack([self._shader.corners_m(pose) for pose in (*poses, middle)])
        return rays.region_around(corners, _REGION_MARGIN_PX)


def _enlarge(small: Array, step: int, height: int, width: int) -> Array:
    return np.repeat(np.repeat(small, step, axis=0), step, axis=1)[:height, :width].copy()


def _facing(hits: Hits, e_from_camera: Array, rays: PixelRays, rows: slice, columns: slice) -> Array:
    return _facing_of(hits.normals, e_from_camera, rays, rows, columns)


def _facing_of(normals: Array, e_from_camera: Array, rays: PixelRays, rows: slice, columns: slice) -> Array:
    """Return the cosine between each ray, reversed, and the surface normal it meets."""
    directions = rays.directions(rows, columns)
    towards = -np.einsum("ij,ij->i", normals @ e_from_camera[:3, :3], directions)
    return np.asarray(towards / np.sqrt(np.einsum("ij,ij->i", directions, directions)))
