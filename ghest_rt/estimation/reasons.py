"""Which of several reasons is told."""

from ghest_rt.messages.results import Reason

# What is wrong nearest to the source of everything else comes first.
_GRAVEST_FIRST = (
    Reason.STARTING,
    Reason.ENCODERS_IMPLAUSIBLE,
    Reason.ENCODERS_SILENT,
    Reason.R0_NO_FRAMES,
    Reason.R1_NO_FRAMES,
    Reason.M0_NOT_SEEN,
    Reason.M1_NOT_SEEN,
)


def gravest(*found: object) -> Reason:
    """Return the gravest of the reasons among the arguments; anything else among them is passed over."""
    return next(reason for reason in _GRAVEST_FIRST if reason in found)
