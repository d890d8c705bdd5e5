"""The pose that explains the disk centres and the plate's plane best: Gauss-Newton on both with their covariances."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ghest_rt.geometry.so3 import Array, exp_so3
from ghest_rt.vision.ellipses import ellipse
from ghest_rt.vision.plate_plane import Plane
from ghest_rt.vision.small import inverse_of

_SMALL_STEP = 1e-3  # rad, and of the distance: the next Gauss-Newton step would be about the square of this


@dataclass(frozen=True, slots=True, eq=False)
class Centers:
    """Disk centres to be explained.

    Attributes:
        plate_m: (n, 2) centres in the plate.
        rays: (n, 2) rays through the centres of their images.
        sigma: (n,) standard deviation of each ray coordinate.
        radius_m: Radius of the disks.
    """

    plate_m: Array
    rays: Array
    sigma: Array
    radius_m: float


@dataclass(frozen=True, slots=True, eq=False)
class PoseFit:
    """The fitted pose.

    Attributes:
        R: (3, 3) rotation, camera from marker.
        p_m: (3,) position in the camera frame.
        information: (6, 6) of (rotation error rad, translation error m) in camera axes.
        center_chi2: Squared deviations of the centres over their variances, summed.
        plane_chi2: The same of the plane; 0 without one.
        plane_off: Relative change of theta that the pose asks of the plane; 0 without one.
        deviations: (n,) distance of each centre from where the pose puts it, in ray units.
        sigma: (n,) what of that noise explains, one standard deviation per coordinate.
    """

    R: Array
    p_m: Array
    information: Array
    center_chi2: float
    plane_chi2: float
    plane_off: float
    deviations: Array
    sigma: Array

    @staticmethod
    def guess(R: Array, p_m: Array) -> "PoseFit":
        """Return a pose of which nothing is known."""
        return PoseFit(R, p_m, np.zeros((6, 6)), 0.0, 0.0, 0.0, np.zeros(0), np.zeros(0))

    def moved(self, R: Array, p_m: Array, information: Array) -> "PoseFit":
        """Return the fit with another pose and its information; what is known of the misfit stays."""
        return PoseFit(R, p_m, information, self.center_chi2, self.plane_chi2, self.plane_off, self.deviations, self.sigma)

    @property
    def chi2(self) -> float:
        """Squared deviations over their variances, all together."""
        return self.center_chi2 + self.plane_chi2

    @property
    def faces_camera(self) -> bool:
        """Whether the plate shows the camera its front."""
        return float(self.R[:, 2] @ self.p_m) < 0.0


def fit_pose(R: Array, p_m: Array, centers: Centers, plane: Plane | None, max_steps: int) -> PoseFit | None:
    """Fit a pose, starting from one that is nearly right.

    Residuals: image centres of the disks with their perspective bias (two each), and theta of the plane, n / (n . p)
    (three). The error is a left perturbation R <- exp(w) R, p <- p + t.

    Args:
        R: (3, 3) rotation to start from.
        p_m: (3,) position to start from, metres.
        centers: What was seen of the disks.
        plane: The plate's plane in the same camera frame, or None.
        max_steps: Most Gauss-Newton steps.

    Returns:
        The fit, or None if it is singular or leaves the space before the camera.
    """
    weights = (1.0 / centers.sigma).repeat(2)
    plane_information = np.zeros((3, 3)) if plane is None else inverse_of(plane.covariance)
    if plane_information is None:
        return None
    places = centers.plate_m.tolist()
    seen = centers.rays.ravel()
    for step in range(max_steps):
        found = _center_terms(R, p_m, places, centers.radius_m)
        if found is None:
            return None
        predicted, J = found
        J *= weights[:, None]
        residual = (seen - predicted) * weights
        information = J.T @ J
        gradient = residual @ J
        if plane is not None:
            off, J_plane = plane_terms(R, p_m, plane)
            weighted = plane_information @ J_plane
            information += J_plane.T @ weighted
            gradient += off @ weighted
        solved, column = cv2.solve(information, gradient, flags=cv2.DECOMP_CHOLESKY)
        change = np.asarray(column, dtype=np.float64).ravel()
        x, y, z, dx, dy, dz = change.tolist()
        size = max(abs(x), abs(y), abs(z), max(abs(dx), abs(dy), abs(dz)) / abs(float(p_m[2])))
        if not solved or not size < 1.0:
            return None
        R = exp_so3(change[:3]) @ R
        p_m = p_m + change[3:]
        if size < _SMALL_STEP or step + 1 == max_steps:
            break
    # What is left is linear in so small a last step.
    residual -= J @ change
    plane_chi2 = plane_off = 0.0
    if plane is not None:
        off -= J_plane @ change
        plane_off = math.sqrt(float(off @ off) / float(plane.theta @ plane.theta))
        plane_chi2 = float(off @ plane_information @ off)
    deviations = np.hypot(residual[::2], residual[1::2]) * centers.sigma
    return PoseFit(R, p_m, information, float(residual @ residual), plane_chi2, plane_off, deviations, centers.sigma)


def plane_terms(R: Array, p_m: Array, plane: Plane) -> tuple[Array, Array]:
    """Return the residual of theta = n / (n . p) (3,) and the Jacobian (3, 6) of the prediction."""
    n = R[:, 2]
    nx, ny, nz = n.tolist()
    px, py, pz = p_m.tolist()
    inverse = 1.0 / (nx * px + ny * py + nz * pz)
    tx, ty, tz = nx * inverse, ny * inverse, nz * inverse
    # d theta = w x n / d - n / d^2 (w . (n x p) + n . t)
    cx, cy, cz = (ny * pz - nz * py) * inverse, (nz * px - nx * pz) * inverse, (nx * py - ny * px) * inverse
    J = np.array(
        [
            [-tx * cx, tz - tx * cy, -ty - tx * cz, -tx * tx, -tx * ty, -tx * tz],
            [-tz - ty * cx, -ty * cy, tx - ty * cz, -ty * tx, -ty * ty, -ty * tz],
            [ty - tz * cx, -tx - tz * cy, -tz * cz, -tz * tx, -tz * ty, -tz * tz],
        ]
    )
    return plane.theta - np.array([tx, ty, tz]), J


def _center_terms(R: Array, p_m: Array, places: list[list[float]], radius_m: float) -> tuple[Array, Array] | None:
    """Return predicted rays (2n,) and their Jacobian (2n, 6); the bias is part of the prediction, not of the Jacobian."""
    (h00, h01, _), (h10, h11, _), (h20, h21, _) = R.tolist()
    px, py, pz = p_m.tolist()
    H = [[h00, h01, px], [h10, h11, py], [h20, h21, pz]]
    predicted: list[float] = []
    rows: list[list[float]] = []
    for x_m, y_m in places:
        image = ellipse(H, x_m, y_m, radius_m)
        if image is None:
            return None
        predicted += image[:2]
        rx, ry, rz = h00 * x_m + h01 * y_m, h10 * x_m + h11 * y_m, h20 * x_m + h21 * y_m
        inverse = 1.0 / (rz + pz)
        au, av = -(rx + px) * inverse * inverse, -(ry + py) * inverse * inverse
        rows.append([ry * au, rz * inverse - rx * au, -ry * inverse, inverse, 0.0, au])
        rows.append([ry * av - rz * inverse, -rx * av, rx * inverse, 0.0, inverse, av])
    return np.array(predicted), np.array(rows)
