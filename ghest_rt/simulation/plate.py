"""The marker plate in the image: its print evaluated per ray in plate coordinates, edges supersampled; exact depth."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array
from ghest_rt.simulation.rays import PixelRays, Region
from ghest_rt.simulation.texture import Texture

_PIXEL_REACH = 0.75  # half a pixel's diagonal, and a little
_MIN_COSINE = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class PlateCover:
    """Where a plate is in a region of the image, by pixel centres.

    Attributes:
        z_m: (h, w) depth of the plate's plane along each pixel's ray; infinite where the ray does not meet its front.
        inside: (h, w) whether the ray through the pixel's centre meets the plate.
    """

    z_m: Array
    inside: NDArray[np.bool_]


class PlateShader:
    """Draws one marker's plate for one camera.

    Args:
        texture: What is printed on it.
        plate_m: Side of the plate.
        supersampling: Samples per pixel side where a pixel holds an edge.
        aperture_px: (n, 2) points of the circle of confusion, each of which adds its own picture; the origin alone if sharp.
    """

    def __init__(self, texture: Texture, plate_m: float, supersampling: int, aperture_px: Array) -> None:
        self._texture = texture
        self._half_m = plate_m / 2
        steps = (np.arange(supersampling) + 0.5) / supersampling - 0.5
        dv, du = np.meshgrid(steps, steps, indexing="ij")
        self._du = (du.ravel() + aperture_px[:, :1]).ravel()
        self._dv = (dv.ravel() + aperture_px[:, 1:]).ravel()
        self._reach_px = _PIXEL_REACH + float(np.hypot(*aperture_px.T).max())

    def corners_m(self, camera_from_marker: Array) -> Array:
        """Return the plate's (4, 3) corners in camera axes."""
        h = self._half_m
        corners = np.array([(-h, -h, 0.0), (h, -h, 0.0), (h, h, 0.0), (-h, h, 0.0)])
        return np.asarray(corners @ camera_from_marker[:3, :3].T + camera_from_marker[:3, 3])

    def cover(self, rays: PixelRays, region: Region, camera_from_marker: Array) -> PlateCover:
        """Return where the plate's front is within a region."""
        x, y = rays.x[region.slices], rays.y[region.slices]
        normal, p = camera_from_marker[:3, 2], camera_from_marker[:3, 3]
        against = normal[0] * x + normal[1] * y + normal[2]
        distance = float(normal @ p)
        front = (against < 0) & (distance < 0)
        z = np.full(x.shape, np.inf)
        np.divide(distance, against, out=z, where=front)
        px, py = _on_plate(x, y, camera_from_marker)
        inside = front & (np.maximum(np.abs(px), np.abs(py)) <= self._half_m)
        return PlateCover(z, inside)

    def draw(self, rays: PixelRays, region: Region, camera_from_marker: Array, background: Array, brightness: float) -> Array:
        """Return the region's (h, w, 3) colours 0-255: the plate, in a given light, over a background."""
        normal, p = camera_from_marker[:3, 2], camera_from_marker[:3, 3]
        facing = -float(normal @ p) / float(np.linalg.norm(p))
        out = background.reshape(-1, 3).copy()
        if facing <= _MIN_COSINE:
            return out.reshape(background.shape)
        x, y = rays.x[region.slices].ravel(), rays.y[region.slices].ravel()
        px, py = _on_plate(x, y, camera_from_marker)
        beyond = np.maximum(np.abs(px), np.abs(py)) - self._half_m
        pixel_m = float(np.abs(rays.step_u[region.v0, region.u0]).max()) * float(p[2])
        reach = self._reach_px * pixel_m / facing
        touched = np.flatnonzero(beyond < reach)
        near = np.minimum(self._texture.edge_distance_m(px[touched], py[touched]), np.abs(beyond[touched])) < reach
        plain, edge = touched[~near], touched[near]
        out[plain] = brightness * self._texture.colors(px[plain], py[plain])
        if len(edge):
            du, dv = rays.step_u[region.slices].reshape(-1, 2)[edge], rays.step_v[region.slices].reshape(-1, 2)[edge]
            sx, sy = _on_plate(
                x[edge, None] + du[:, :1] * self._du + dv[:, :1] * self._dv,
                y[edge, None] + du[:, 1:] * self._du + dv[:, 1:] * self._dv,
                camera_from_marker,
            )
            samples = brightness * self._texture.colors(sx.ravel(), sy.ravel()).reshape(*sx.shape, 3)
            off = np.maximum(np.abs(sx), np.abs(sy)) > self._half_m
            samples = np.where(off[:, :, None], out[edge][:, None, :], samples)
            out[edge] = samples.mean(axis=1)
        return out.reshape(background.shape)


def _on_plate(x: Array, y: Array, camera_from_marker: Array) -> tuple[Array, Array]:
    """Return plate coordinates where rays (x, y, 1) meet the plate's plane."""
    plane = np.column_stack((camera_from_marker[:3, 0], camera_from_marker[:3, 1], camera_from_marker[:3, 3]))
    h = np.linalg.inv(plane)
    w = h[2, 0] * x + h[2, 1] * y + h[2, 2]
    return (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / w, (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / w
