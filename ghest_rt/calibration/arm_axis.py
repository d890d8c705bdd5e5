"""What gives the upper arm's axis; in a file that imports nothing, since the command line reads it at every start."""

from enum import StrEnum


class ArmAxis(StrEnum):
    """What gives the upper arm's axis in a calibration."""

    POSTURE = "posture"
    EXOSKELETON = "exoskeleton"
