"""Rival 1: the exoskeleton's joint angles taken for the patient's."""

from ghest_rt.geometry.so3 import Array, rot_x, rot_y, rot_z
from ghest_rt.studies.rivals.neutral import NeutralCalibration


class ExoskeletonAlone:
    """SAA = j0 + j1, SFE = j2, SIER = j6, each from its reading in the neutral posture.

    The three turn one after the other, as the exoskeleton's axes do: Rx(SAA) Ry(SFE) Rz(SIER) is taken for the arm's rotation.
    """

    def __init__(self, calibration: NeutralCalibration) -> None:
        self._calibration = calibration
        self._neutral = calibration.named(calibration.joints)

    def gh_from_arm(self, joints: Array) -> Array:
        """See `PostureModel`."""
        q = self._calibration.named(joints)
        turned = {name: q[name] - self._neutral[name] for name in q}
        return rot_x(turned["j0"] + turned["j1"]) @ rot_y(turned["j2"]) @ rot_z(turned["j6"])
