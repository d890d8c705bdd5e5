"""The elbow's angles, where the forearm is strapped to a link of the exoskeleton: definitions in docs/angles.md.

With f the forearm's direction (elbow to wrist) in the arm frame, from the link's pose by forward kinematics:

    flexion  = atan2(s fy, -fz)      carrying = asin(fx)      s = +1 for a right arm, -1 for a left one

An error phi of the arm's rotation (arm axes) moves f by f x phi; an error of the strapped direction adds to both angles.
"""

import math
from collections.abc import Sequence

import numpy as np

from ghest_rt.config.station import Elbow
from ghest_rt.estimation.angles import Arm
from ghest_rt.geometry.so3 import Array
from ghest_rt.kinematics.forward import ForwardKinematics
from ghest_rt.messages.results import ElbowAngles

# The cosine below which the forearm lies along the flexion axis and flexion means nothing.
_LEAST_COSINE = 1e-3


class ElbowGeometry:
    """Where the forearm is on this station's exoskeleton."""

    def __init__(self, elbow: Elbow, arm: Arm, fk: ForwardKinematics, encoder_joints: Sequence[str]) -> None:
        """Prepare.

        Args:
            elbow: The station file's `[elbow]`.
            arm: The patient's arm.
            fk: Knows the pose of `elbow.link`.
            encoder_joints: The joints that the encoder link sends, in its order.
        """
        self._fk = fk
        self._link = elbow.link
        self._axis = np.array(elbow.axis) / np.linalg.norm(elbow.axis)
        self._variance = math.radians(elbow.axis_sigma_deg) ** 2
        self._side = 1.0 if arm == "right" else -1.0
        self._pronation = None if elbow.pronation_joint is None else list(encoder_joints).index(elbow.pronation_joint)

    def forearm_in_e(self, joint_positions: Array) -> Array:
        """Return the forearm's direction, elbow to wrist: (3,) unit vector, E axes.

        Args:
            joint_positions: (n,) rad (m for prismatic joints).
        """
        return np.asarray(self._fk.link_pose(self._link, joint_positions)[:3, :3] @ self._axis)

    def angles(self, e_from_arm: Array, joint_positions: Array, covariance: Array | None) -> ElbowAngles | None:
        """Return the elbow's angles.

        Args:
            e_from_arm: (4, 4) upper arm in E.
            joint_positions: (n,) rad (m for prismatic joints) at the same instant.
            covariance: (3, 3) of the error of the arm's rotation, rad, E axes; None if unknown.

        Returns:
            None if the forearm seems to lie along the elbow's flexion axis.
        """
        R = e_from_arm[:3, :3]
        fx, fy, fz = R.T.dot(self.forearm_in_e(joint_positions)).tolist()
        cosine = math.hypot(fy, fz)
        if cosine < _LEAST_COSINE:
            return None
        sigma = None
        if covariance is not None:
            # Of flexion and carrying angle by the arm's rotation, E axes.
            J = np.array([[-1.0, fx * fy / cosine**2, fx * fz / cosine**2], [0.0, -fz / cosine, fy / cosine]]).dot(R.T)
            flexion, carrying = J.dot(covariance).dot(J.T).diagonal().tolist()
            sigma = (math.sqrt(flexion + self._variance / cosine**2), math.sqrt(carrying + self._variance))
        return ElbowAngles(
            flexion_rad=math.atan2(self._side * fy, -fz),
            carrying_rad=math.atan2(fx, cosine),
            pronation_rad=None if self._pronation is None else float(joint_positions[self._pronation]),
            sigma_rad=sigma,
        )
