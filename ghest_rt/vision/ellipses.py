"""Images of the marker's disks: what a homography from the plate to the rays makes of them.

A disk of radius r around (X, Y) has the dual conic diag(r^2, r^2, -1) in coordinates centred on it. With the homography's
columns h1, h2 and m = H (X, Y, 1) its image is the dual conic G - m m^T, G = r^2 (h1 h1^T + h2 h2^T), an ellipse of centre
c = (m_z m_xy - G_xyz) / (m_z^2 - G_zz) and shape S = (G_xy - m_xy m_xy^T) / (m_z^2 - G_zz) + c c^T, the points
(x - c)^T S^-1 (x - c) = 1. Its centre is *not* the image m_xy / m_z of the disk's centre: that is the perspective bias.
"""

import math
from dataclasses import dataclass

from ghest_rt.geometry.so3 import Array
from ghest_rt.vision.optics import Optics

# The few numbers of a frame's four ellipses are plain floats: arrays this small cost more to call than to compute.


@dataclass(frozen=True, slots=True)
class DiskImage:
    """Where one disk should appear, in pixels: centre (u, v) and shape matrix S = [[a, b], [b, c]]."""

    u: float
    v: float
    a: float
    b: float
    c: float

    @property
    def determinant(self) -> float:
        """The fourth power of the geometric mean of the semi-axes."""
        return self.a * self.c - self.b * self.b

    @property
    def minor_px(self) -> float:
        """The smaller semi-axis."""
        root = math.sqrt((self.a - self.c) ** 2 + 4.0 * self.b * self.b)
        return math.sqrt(max(0.5 * (self.a + self.c - root), 0.0))


@dataclass(frozen=True, slots=True)
class MarkerImage:
    """Where the marker should appear.

    Attributes:
        disks: p0..p3.
        plate_px: Derivatives u_X, u_Y, v_X, v_Y of pixels by plate coordinates (per metre) at the plate's centre.
        minor_px: Least semi-axis of all disks.
        extent_px: Greatest half width or half height of all disks.
    """

    disks: tuple[DiskImage, DiskImage, DiskImage, DiskImage]
    plate_px: tuple[float, float, float, float]
    minor_px: float
    extent_px: float


def marker_image(H: Array, centers_m: list[list[float]], radius_m: float, optics: Optics) -> MarkerImage | None:
    """Return the image of the marker, or None if a disk is not wholly in front of the camera.

    Args:
        H: (3, 3) homography from plate coordinates (metres) to rays.
        centers_m: Centres of the four disks in the plate.
        radius_m: Radius of the disks.
        optics: The colour camera's lens.
    """
    disks = []
    rows = H.tolist()
    for x_m, y_m in centers_m:
        found = ellipse(rows, x_m, y_m, radius_m)
        if found is None:
            return None
        x, y, sxx, sxy, syy = found
        u, v, ux, uy, vx, vy = optics.place(x, y)
        pxx, pxy, pyx, pyy = ux * sxx + uy * sxy, ux * sxy + uy * syy, vx * sxx + vy * sxy, vx * sxy + vy * syy
        disks.append(DiskImage(u, v, pxx * ux + pxy * uy, pxx * vx + pxy * vy, pyx * vx + pyy * vy))
    (h00, h01, h02), (h10, h11, h12), (h20, h21, h22) = rows
    x, y = h02 / h22, h12 / h22
    _, _, ux, uy, vx, vy = optics.place(x, y)
    xX, xY, yX, yY = (h00 - x * h20) / h22, (h01 - x * h21) / h22, (h10 - y * h20) / h22, (h11 - y * h21) / h22
    return MarkerImage(
        disks=(disks[0], disks[1], disks[2], disks[3]),
        plate_px=(ux * xX + uy * yX, ux * xY + uy * yY, vx * xX + vy * yX, vx * xY + vy * yY),
        minor_px=min(disk.minor_px for disk in disks),
        extent_px=math.sqrt(max(max(disk.a, disk.c) for disk in disks)),
    )


def ellipse(
    rows: list[list[float]], x_m: float, y_m: float, radius_m: float
) -> tuple[float, float, float, float, float] | None:
    """Return (c_x, c_y, S_xx, S_xy, S_yy) of a disk's image in rays; None if it reaches behind the camera.

    Args:
        rows: The three rows of the homography from plate coordinates (metres) to rays.
        x_m: Centre of the disk in the plate.
        y_m: Centre of the disk in the plate.
        radius_m: Its radius.
    """
    (h00, h01, h02), (h10, h11, h12), (h20, h21, h22) = rows
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
