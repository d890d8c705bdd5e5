"""Images of the marker's disks: what a homography from the plate to the rays makes of them.

A disk of radius r around (X, Y) has the dual conic diag(r^2, r^2, -1) in coordinates centred on it. With the homography's
columns h1, h2 and m = H (X, Y, 1) its image is the dual conic G - m m^T, G = r^2 (h1 h1^T + h2 h2^T), an ellipse of centre
c = (m_z m_xy - G_xyz) / (m_z^2 - G_zz) and shape S = (G_xy - m_xy m_xy^T) / (m_z^2 - G_zz) + c c^T, the points
(x - c)^T S^-1 (x - c) = 1. Its centre is *not* the image m_xy / m_z of the disk's centre: that is the perspective bias.
"""

from dataclasses import dataclass

import numpy as np

from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.optics import Optics


@dataclass(frozen=True, slots=True, eq=False)
class DiskImages:
    """Where the disks should appear, in pixels.

    Attributes:
        centers_px: (n, 2) centres of the ellipses.
        shapes_px2: (n, 2, 2) shape matrices S.
        plate_px: (2, 2) derivative of pixels by plate coordinates (per metre) at the plate's centre.
        minor_px: Least semi-axis of all ellipses.
        extent_px: Greatest half width or half height of all ellipses.
    """

    centers_px: Array
    shapes_px2: Array
    plate_px: Array
    minor_px: float
    extent_px: float


def disk_images(H: Array, centers_m: Array, radius_m: float, optics: Optics) -> DiskImages | None:
    """Return the images of the disks, or None if one is not wholly in front of the camera.

    Args:
        H: (3, 3) homography from plate coordinates (metres) to rays.
        centers_m: (n, 2) disk centres in the plate.
        radius_m: Radius of the disks.
        optics: The colour camera's lens.
    """
    images = [ellipse(H, x, y, radius_m) for x, y in centers_m.tolist()]
    if None in images:
        return None
    numbers = np.array(images)
    rays = numbers[:, :2]
    S = numbers[:, (2, 3, 3, 4)].reshape(-1, 2, 2)
    J = optics.jacobians(rays)
    shapes_px2 = J @ S @ J.transpose(0, 2, 1)
    a, b, c = shapes_px2[:, 0, 0], shapes_px2[:, 0, 1], shapes_px2[:, 1, 1]
    minor2 = 0.5 * (a + c - np.sqrt((a - c) ** 2 + 4 * b * b))
    weight = 1.0 / H[2, 2]
    v = H[:2, 2] * weight
    plate = (H[:2, :2] - np.outer(v, H[2, :2])) * weight
    return DiskImages(
        centers_px=optics.pixels(rays),
        shapes_px2=shapes_px2,
        plate_px=J.mean(axis=0) @ plate,
        minor_px=float(np.sqrt(max(minor2.min(), 0.0))),
        extent_px=float(np.sqrt(max(a.max(), c.max()))),
    )


def ellipse(H: Array, x_m: float, y_m: float, radius_m: float) -> tuple[float, float, float, float, float] | None:
    """Return (c_x, c_y, S_xx, S_xy, S_yy) of a disk's image in rays; None if it reaches behind the camera."""
    (h00, h01, h02), (h10, h11, h12), (h20, h21, h22) = H.tolist()
    mx, my, mz = h00 * x_m + h01 * y_m + h02, h10 * x_m + h11 * y_m + h12, h20 * x_m + h21 * y_m + h22
    r2 = radius_m * radius_m
    gxx, gxy, gyy = r2 * (h00 * h00 + h01 * h01), r2 * (h00 * h10 + h01 * h11), r2 * (h10 * h10 + h11 * h11)
    gxz, gyz, gzz = r2 * (h00 * h20 + h01 * h21), r2 * (h10 * h20 + h11 * h21), r2 * (h20 * h20 + h21 * h21)
    scale = mz * mz - gzz
    if mz <= 0.0 or scale <= 0.0:
        return None
    scale = 1.0 / scale
    cx, cy = (mz * mx - gxz) * scale, (mz * my - gyz) * scale
    return (
        cx,
        cy,
        (gxx - mx * mx) * scale + cx * cx,
        (gxy - mx * my) * scale + cx * cy,
        (gyy - my * my) * scale + cy * cy,
    )
