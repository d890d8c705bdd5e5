"""The pose that explains the disk centres and the plate's plane best: Gauss-Newton on both with their covariances."""

from dataclasses import dataclass

import numpy as np

from ghest_rt.geometry.so3 import Array, exp_so3, skew
from ghest_rt.vision.ellipses import ellipse
from ghest_rt.vision.plate_plane import Plane

_SMALL_STEP = 1e-6  # rad; metres are held to the same fraction of the distance


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
        deviations: (n,) distance of each centre from where the pose puts it, in ray units.
    """

    R: Array
    p_m: Array
    information: Array
    center_chi2: float
    plane_chi2: float
    deviations: Array


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
    weights = np.repeat(1.0 / centers.sigma, 2)
    plane_information = None if plane is None else np.linalg.inv(plane.covariance)
    places = centers.plate_m.tolist()
    seen = centers.rays.ravel()
    for step in range(max_steps + 1):
        found = _center_terms(R, p_m, places, centers.radius_m)
        if found is None:
            return None
        predicted, J = found
        residual = seen - predicted
        scaled = residual * weights
        J *= weights[:, None]
        information = J.T @ J
        gradient = scaled @ J
        plane_chi2 = 0.0
        if plane is not None and plane_information is not None:
            n = R[:, 2]
            distance_m = float(n @ p_m)
            off = plane.theta - n / distance_m
            J_plane = np.empty((3, 6))
            J_plane[:, :3] = -skew(n) / distance_m - np.outer(n, _cross(n, p_m)) / distance_m**2
            J_plane[:, 3:] = -np.outer(n, n) / distance_m**2
            pull = plane_information @ off
            information += J_plane.T @ plane_information @ J_plane
            gradient += pull @ J_plane
            plane_chi2 = float(off @ pull)
        center_chi2 = float(scaled @ scaled)
        if step == max_steps:
            break
        try:
            change = np.linalg.solve(information, gradient)
        except np.linalg.LinAlgError:
            return None
        size = float(np.abs(change[:3]).max())
        if not size < 1.0:
            return None
        R = exp_so3(change[:3]) @ R
        p_m = p_m + change[3:]
        if size < _SMALL_STEP and float(np.abs(change[3:]).max()) < _SMALL_STEP * abs(float(p_m[2])):
            break
    return PoseFit(R, p_m, information, center_chi2, plane_chi2, np.hypot(residual[::2], residual[1::2]))


def _center_terms(R: Array, p_m: Array, places: list[list[float]], radius_m: float) -> tuple[Array, Array] | None:
    """Return predicted rays (2n,) and their Jacobian (2n, 6); the bias is part of the prediction, not of the Jacobian."""
    H = np.column_stack([R[:, 0], R[:, 1], p_m])
    (h00, h01, px), (h10, h11, py), (h20, h21, pz) = H.tolist()
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


def _cross(a: Array, b: Array) -> Array:
    a0, a1, a2 = a.tolist()
    b0, b1, b2 = b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])
