"""Any lens model to OpenCV's plumb-bob model (k1, k2, p1, p2, k3), by fitting the one to the other.

With an ideal point (x, y), r² = x² + y², OpenCV's distorted point is

    x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
    y_d = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p2 x y + p1 (r² + 2 y²)

which is linear in the coefficients: pairs of ideal and distorted points give them by linear least squares.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
PlumbBob = tuple[float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class DistortionFit:
    """The nearest plumb-bob model.

    Attributes:
        coefficients: (k1, k2, p1, p2, k3).
        rms_error_px: Distance between where the two models put a point, root mean square.
        max_error_px: The greatest, in the corners.
    """

    coefficients: PlumbBob
    rms_error_px: float
    max_error_px: float


def image_grid(width_px: int, height_px: int, columns: int = 33, rows: int = 25) -> Points:
    """Return (columns * rows, 2) pixel positions that cover an image to its corners."""
    u, v = np.meshgrid(np.linspace(0.0, width_px - 1.0, columns), np.linspace(0.0, height_px - 1.0, rows))
    return np.stack([u.ravel(), v.ravel()], axis=1)


def fit_plumb_bob(ideal: Points, distorted: Points, focal_px: float) -> DistortionFit:
    """Fit the model to points on the plane z = 1.

    Args:
        ideal: (n, 2) as a pinhole would see them.
        distorted: (n, 2) as the lens shows them.
        focal_px: Focal length, to state the error in pixels.
    """
    x, y = ideal[:, 0], ideal[:, 1]
    r2 = x * x + y * y
    powers = np.stack([r2, r2**2, r2**3], axis=1)
    along_u = np.column_stack([x * powers[:, 0], x * powers[:, 1], 2 * x * y, r2 + 2 * x * x, x * powers[:, 2]])
    along_v = np.column_stack([y * powers[:, 0], y * powers[:, 1], r2 + 2 * y * y, 2 * x * y, y * powers[:, 2]])
    design = np.concatenate([along_u, along_v])
    shift = np.concatenate([distorted[:, 0] - x, distorted[:, 1] - y])
    k1, k2, p1, p2, k3 = (float(value) for value in np.linalg.lstsq(design, shift, rcond=None)[0])
    residual = (design @ np.array([k1, k2, p1, p2, k3]) - shift).reshape(2, -1)
    error_px = np.hypot(residual[0], residual[1]) * focal_px
    return DistortionFit((k1, k2, p1, p2, k3), float(np.sqrt(np.mean(error_px**2))), float(error_px.max()))
