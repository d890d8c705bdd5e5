"""Pixels and rays of one lens, fast for the handful of points a frame needs."""

import numpy as np

from ghest_drivers.samples import Intrinsics
from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.registration import ray_grid


class Optics:
    """Pinhole with plumb-bob distortion. "Rays" are (x/z, y/z) with the distortion taken off.

    Args:
        intrinsics: The lens.
    """

    def __init__(self, intrinsics: Intrinsics) -> None:
        self._intrinsics = intrinsics
        self.width_px = intrinsics.width_px
        self.height_px = intrinsics.height_px
        self.focal_px: Array = np.array([intrinsics.fx_px, intrinsics.fy_px])
        self.center_px: Array = np.array([intrinsics.cx_px, intrinsics.cy_px])
        self._numbers = (intrinsics.fx_px, intrinsics.fy_px, intrinsics.cx_px, intrinsics.cy_px)
        self.mean_focal_px = float(self.focal_px.mean())
        self._k = intrinsics.distortion
        self.ideal = not any(intrinsics.distortion)
        self._maps = None if self.ideal else _ray_maps(intrinsics)

    def pixels(self, rays: Array) -> Array:
        """Return the (n, 2) pixel coordinates of (n, 2) rays."""
        if self.ideal:
            return rays * self.focal_px + self.center_px
        k1, k2, p1, p2, k3 = self._k
        x, y = rays[:, 0], rays[:, 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        out = np.empty_like(rays)
        out[:, 0] = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        out[:, 1] = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return out * self.focal_px + self.center_px

    def place(self, x: float, y: float) -> tuple[float, float, float, float, float, float]:
        """Return the pixel (u, v) of a ray and the derivatives u_x, u_y, v_x, v_y there."""
        fx, fy, cx, cy = self._numbers
        if self.ideal:
            return fx * x + cx, fy * y + cy, fx, 0.0, 0.0, fy
        k1, k2, p1, p2, k3 = self._k
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3))
        cross = x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
        return (
            fx * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + cx,
            fy * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + cy,
            fx * (radial + x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x),
            fx * cross,
            fy * cross,
            fy * (radial + y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x),
        )

    def ray_table(self) -> Array:
        """Return (3, height * width): the rays (x, y, 1) of all pixels, row by row."""
        rays = ray_grid(self._intrinsics).reshape(-1, 2).T
        return np.ascontiguousarray(np.concatenate([rays, np.ones((1, rays.shape[1]))]))

    def disk_rays(self, centroids_px: Array, radius2_px: Array) -> Array:
        """Return the rays (n, 2) through the centroids of small disk images (n, 2), as an undistorted image would show them.

        A curved lens moves the centroid of a spot otherwise than the point there: to second order by
        r^2 (laplace(ray) / 8 + (grad log det J . grad) ray / 4), with J the derivative of rays by pixels.

        Args:
            centroids_px: (n, 2) centroids in the image.
            radius2_px: Square of the spots' radius (geometric mean of the semi-axes), (n, 1); 0 for plain points.
        """
        if self._maps is None:
            return (centroids_px - self.center_px) / self.focal_px
        low = np.floor(centroids_px).astype(np.intp)
        np.clip(low, 0, (self.width_px - 2, self.height_px - 2), out=low)
        part = centroids_px - low
        fx, fy = part[:, :1], part[:, 1:]
        first = low[:, 1] * self.width_px + low[:, 0]
        corners = self._maps.take(first[:, None] + (0, 1, self.width_px, self.width_px + 1), axis=0)
        top = corners[:, 0] * (1 - fx) + corners[:, 1] * fx
        bottom = corners[:, 2] * (1 - fx) + corners[:, 3] * fx
        both = np.asarray(top * (1 - fy) + bottom * fy, dtype=np.float64)
        return both[:, :2] + radius2_px * both[:, 2:]


def _ray_maps(intrinsics: Intrinsics) -> Array:
    """Return (h * w, 4): the ray of every pixel, and the second-order shift of a unit-radius spot's centroid."""
    rays = ray_grid(intrinsics)
    dv, du = (np.asarray(slope, dtype=np.float64) for slope in np.gradient(rays, axis=(0, 1)))
    laplace = np.gradient(dv, axis=0) + np.gradient(du, axis=1)
    log_det = np.log(np.abs(du[..., 0] * dv[..., 1] - du[..., 1] * dv[..., 0]))
    slope_v, slope_u = np.gradient(log_det)
    shift = laplace / 8.0 + (slope_u[..., None] * du + slope_v[..., None] * dv) / 4.0
    return np.concatenate([rays, shift], axis=2).reshape(-1, 4)
