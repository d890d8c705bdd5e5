"""Rivals 3 and 4: the arm's posture from the pose of the hand and a rule for the swivel angle (the paper's [17]-[20]).

The hand's pose leaves one freedom: the elbow may swivel about the line from shoulder to wrist. [18, 19] choose the swivel that
lets the palm be retracted to the head most readily: the projection of the longest axis of the arm's manipulability
ellipsoid on the way from wrist to mouth is greatest when the plane of the arm contains the mouth, elbow on the far side.
[17] adds an offset for the orientation of the wrist: the joints of forearm and wrist shall keep away from the ends of their
ranges.
"""

import math

import numpy as np

from ghest_rt.geometry.se3 import inverse
from ghest_rt.geometry.so3 import Array
from ghest_rt.studies.rivals.neutral import NeutralCalibration

# Middle and half of the range of pronation, wrist flexion and wrist deviation, rad.
_MIDDLE_RAD = np.radians((0.0, 0.0, 0.0))
_HALF_RAD = np.radians((85.0, 75.0, 25.0))
_SEARCH_RAD = np.radians(np.arange(-60.0, 60.5, 1.0))
_LEAST_SINE = 0.05


class SwivelAngle:
    """The arm from shoulder, wrist and a swivel angle.

    The shoulder stands still where it was in the neutral posture; the hand is fixed to the grip (l10), the wrist to the forearm
    module (l8), as they were then. The rule is corrected by what it was wrong in the neutral posture.
    """

    def __init__(self, calibration: NeutralCalibration, *, wrist_aware: bool) -> None:
        """Calibrate in the neutral posture.

        Args:
            calibration: The neutral posture.
            wrist_aware: Whether the orientation of the hand takes part, as in [17] and [20].
        """
        self._kinematics = calibration.kinematics
        self._upper_m, self._fore_m = calibration.body.upper_arm_m, calibration.body.forearm_m
        self._shoulder_m = calibration.gh_in_e_m
        self._mouth_m = calibration.mouth_in_e_m
        self._wrist_aware = wrist_aware
        module, grip = (self._kinematics.link_pose(link, calibration.joints) for link in ("l8", "l10"))
        self._wrist_in_module_m = (inverse(module) @ calibration.e_from_hand)[:3, 3]
        self._grip_from_hand = grip[:3, :3].T @ calibration.e_from_hand[:3, :3]
        self._offset_rad = 0.0
        wrist_m, hand = self._hand(calibration.joints)
        elbow_m = self._shoulder_m - np.array([0.0, 0.0, self._upper_m])
        along, u, v = _circle_axes(self._shoulder_m, wrist_m)
        radial = elbow_m - self._shoulder_m
        true_rad = math.atan2(float(radial @ v), float(radial @ u))
        self._offset_rad = true_rad - self._rule_rad(along, u, v, wrist_m, hand)

    def gh_from_arm(self, joints: Array) -> Array | None:
        """See `PostureModel`; None with the elbow stretched, where the swivel means nothing."""
        wrist_m, hand = self._hand(joints)
        along, u, v = _circle_axes(self._shoulder_m, wrist_m)
        swivel_rad = self._rule_rad(along, u, v, wrist_m, hand) + self._offset_rad
        frames = self._arm_frames(wrist_m, np.array([swivel_rad]))
        return None if frames is None else np.asarray(frames[0])

    def _hand(self, joints: Array) -> tuple[Array, Array]:
        """Return the wrist in E, (3,) metres, and the hand's (3, 3) rotation."""
        module, grip = (self._kinematics.link_pose(link, joints) for link in ("l8", "l10"))
        return module[:3, :3] @ self._wrist_in_module_m + module[:3, 3], grip[:3, :3] @ self._grip_from_hand

    def _rule_rad(self, along: Array, u: Array, v: Array, wrist_m: Array, hand: Array) -> float:
        """Return the swivel angle by the rule, from u towards v."""
        to_mouth = self._mouth_m - self._shoulder_m
        away = (to_mouth @ along) * along - to_mouth
        swivel_rad = math.atan2(float(away @ v), float(away @ u))
        return swivel_rad + self._wrist_offset_rad(wrist_m, hand, swivel_rad) if self._wrist_aware else swivel_rad

    def _wrist_offset_rad(self, wrist_m: Array, hand: Array, swivel_rad: float) -> float:
        """Return the offset that balances leaving the rule against the joints' distance from the middle of their ranges."""
        frames = self._arm_frames(wrist_m, swivel_rad + _SEARCH_RAD)
        if frames is None:
            return 0.0
        elbow_m = self._shoulder_m - self._upper_m * frames[:, :, 2]
        forearm_z = (elbow_m - wrist_m) / self._fore_m
        forearm = np.stack((frames[:, :, 0], np.cross(forearm_z, frames[:, :, 0]), forearm_z), axis=-1)
        relative = np.swapaxes(forearm, 1, 2) @ hand  # = Rz(pronation) Rx(flexion) Ry(deviation)
        flexion = np.arcsin(np.clip(relative[:, 2, 1], -1.0, 1.0))
        pronation = np.arctan2(-relative[:, 0, 1], relative[:, 1, 1])
        deviation = np.arctan2(-relative[:, 2, 0], relative[:, 2, 2])
        joints = np.column_stack((pronation, flexion, deviation))
        cost = 1.0 - np.cos(_SEARCH_RAD) + np.square((joints - _MIDDLE_RAD) / _HALF_RAD).mean(axis=1)
        best = int(np.argmin(cost))
        if not 0 < best < len(cost) - 1:
            return float(_SEARCH_RAD[best])
        before, at, after = cost[best - 1 : best + 2]
        step_rad = float(_SEARCH_RAD[1] - _SEARCH_RAD[0])
        return float(_SEARCH_RAD[best]) + 0.5 * step_rad * float((before - after) / (before - 2.0 * at + after))

    def _arm_frames(self, wrist_m: Array, swivel_rad: Array) -> Array | None:
        """Return the (k, 3, 3) frames of the arm for (k,) swivel angles: z from elbow to shoulder, x the elbow's axis."""
        along, u, v = _circle_axes(self._shoulder_m, wrist_m)
        reach_m = float(np.linalg.norm(wrist_m - self._shoulder_m))
        cosine = (self._upper_m**2 + reach_m**2 - self._fore_m**2) / (2.0 * self._upper_m * reach_m)
        sine = math.sqrt(max(0.0, 1.0 - cosine**2))
        if sine < _LEAST_SINE:
            return None
        radial = np.cos(swivel_rad)[:, None] * u + np.sin(swivel_rad)[:, None] * v
        to_elbow = cosine * along + sine * radial
        z = -to_elbow
        forearm = wrist_m - self._shoulder_m - self._upper_m * to_elbow
        y = forearm - np.einsum("ij,ij->i", forearm, z)[:, None] * z
        y /= np.linalg.norm(y, axis=1)[:, None]
        return np.stack((np.cross(y, z), y, z), axis=-1)


def _circle_axes(shoulder_m: Array, wrist_m: Array) -> tuple[Array, Array, Array]:
    """Return the direction from shoulder to wrist, and two axes across it, the first one as far down as it can be."""
    along = (wrist_m - shoulder_m) / np.linalg.norm(wrist_m - shoulder_m)
    down = np.array([-1.0, 0.0, 0.0])
    u = down - (down @ along) * along
    u /= np.linalg.norm(u)
    return along, u, np.cross(along, u)
