"""Step (2) of the paper's 3.3.1, eq. (1)-(3): from disk centres in the colour image to points in the camera frame."""

import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array


def point_cloud(depth_counts: NDArray[np.uint16], depth_unit_m: float, rays: Array) -> Array:
    """Return D_i: (L*N*3,) coordinates x, y, z of every depth pixel in the camera frame, row after row; zeros where unknown.

    Args:
        depth_counts: (N, L) depth image I^d.
        depth_unit_m: Metres per count.
        rays: (N, L, 2) x/z and y/z of every pixel.
    """
    cloud = np.empty((*depth_counts.shape, 3))
    z_m = np.multiply(depth_counts, depth_unit_m, out=cloud[..., 2])
    np.multiply(rays, z_m[..., None], out=cloud[..., :2])
    return cloud.reshape(-1)


def depth_pixel_eq1(u: int, v: int, color_size: tuple[int, int], depth_size: tuple[int, int]) -> tuple[int, int]:
    """Eq. (1): the depth pixel of a colour pixel; both images have the same coordinate system. Rounded to whole pixels.

    Args:
        u: Column in the colour image.
        v: Row in the colour image.
        color_size: (A, B), width and height of the colour image.
        depth_size: (L, N), width and height of the depth image.
    """
    A, B = color_size
    L, N = depth_size
    return round((L - 1) / (A - 1) * u), round((N - 1) / (B - 1) * v)


def cloud_indices_eq2(u: int, v: int, L: int) -> tuple[int, int, int]:
    """Eq. (2): where x, y and z of depth pixel (u, v) stand in D_i.

    The paper prints 3*u + L*v, which misses the row by a factor of three; meant is 3*(u + L*v).
    """
    first = 3 * (u + L * v)
    return first, first + 1, first + 2


def point_eq3(cloud: Array, indices: tuple[int, int, int]) -> Array | None:
    """Eq. (3): the point (3,) in the camera frame, metres; None where depth was not measured."""
    point_m = cloud[list(indices)]
    return point_m if point_m[2] > 0 else None
