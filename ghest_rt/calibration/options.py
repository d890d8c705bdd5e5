"""What is to be said of a calibration session that the recording alone does not tell."""

import re
from dataclasses import dataclass

from ghest_rt.calibration.arm_axis import ArmAxis
from ghest_rt.config.strict import FORM_IN_WORDS, NAME_FORM
from ghest_rt.errors import BadInputError


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationOptions:
    """What the session alone does not say.

    Attributes:
        calibration_id: Name of the new calibration.
        elbow_from: What gives the arm's axis.
        arm_length_m: From elbow to GH centre as measured on the patient; None if it was not.
        posture_unchecked: Whether a neutral posture is taken that the exoskeleton's elbow cannot vouch for.

    Raises:
        BadInputError: No station file takes that name.
    """

    calibration_id: str
    elbow_from: ArmAxis = ArmAxis.POSTURE
    arm_length_m: float | None = None
    posture_unchecked: bool = False

    def __post_init__(self) -> None:
        if not re.fullmatch(NAME_FORM, self.calibration_id):
            raise BadInputError(f"--id {self.calibration_id!r}: {FORM_IN_WORDS[NAME_FORM]}")
