"""What the calibration session saw besides the markers, held against this session; section 6 of docs/fused-estimator.md.

The elbow's place in the link of camera r1 tells a turn of m1 from a slide, the forearm a turn of m1 about the arm.
"""

import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.config.station import Calibration
from ghest_rt.geometry.so3 import Array


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """The calibration session, `[calibration.reference]` of the station file.

    Attributes:
        elbow_m: (3,) the elbow in camera r1, m; None where it is not known.
        elbow_sigma_m: Standard deviation of that from session to session, per axis.
        forearm_rad: How the forearm stood out of the elbow frame's y-z plane; None where it is not known.
        forearm_sigma_rad: Standard deviation of that.
    """

    elbow_m: Array | None = None
    elbow_sigma_m: float = 0.0
    forearm_rad: float | None = None
    forearm_sigma_rad: float = 0.0

    @classmethod
    def of(cls, calibration: Calibration) -> "Reference":
        """Return what a station file says."""
        said = calibration.reference
        elbow_m = None
        if said.elbow_in_link_m is not None:
            link_from_r1 = calibration.link_from_camera_array("r1")
            elbow_m = link_from_r1[:3, :3].T @ (np.array(said.elbow_in_link_m) - link_from_r1[:3, 3])
        return cls(
            elbow_m=elbow_m,
            elbow_sigma_m=said.elbow_sigma_m,
            forearm_rad=None if said.forearm_twist_deg is None else math.radians(said.forearm_twist_deg),
            forearm_sigma_rad=math.radians(said.forearm_sigma_deg),
        )
