"""Why a reading was not passed on, and how often."""

from collections import Counter
from dataclasses import dataclass, field
from enum import StrEnum


class Rejection(StrEnum):
    """Why something received did not become a sample."""

    BAD_LENGTH = "bad_length"  # the length field contradicts the format
    BAD_CHECKSUM = "bad_checksum"
    BAD_FIELDS = "bad_fields"  # a line with too few, too many or unreadable fields
    LINE_TOO_LONG = "line_too_long"
    BAD_FRAME = "bad_frame"  # a CAN frame that its DBC message cannot decode, or an error frame
    INCOMPLETE = "incomplete"  # frames of one sample are missing or came too late
    DEVICE_FAULT = "device_fault"  # the device's own status says that the angles are not to be trusted
    DUPLICATE = "duplicate"  # the same reading once more
    CLOCK_SUSPECT = "clock_suspect"  # the device time contradicts all before it
    NOT_ADVANCING = "not_advancing"  # not later than the sample before
    SUPERSEDED = "superseded"  # of a burst without a device time, or right after opening, only the last can be placed in time
    NOT_FINITE = "not_finite"
    OUT_OF_RANGE = "out_of_range"  # beyond the joint's limits
    TOO_FAST = "too_fast"  # no joint can have moved so far since the last accepted sample
    OVERRUN = "overrun"  # nobody read it in time


@dataclass(slots=True)
class LinkStats:
    """Counters of one link since it was made; they survive re-opening.

    Attributes:
        accepted: Samples passed on.
        lost: Samples that the device counted and that never arrived whole.
        seq_jumps: Times the device's counter jumped without a believable loss (restart).
        bytes_discarded: Bytes that belonged to no valid frame or line.
        rejected: Readings refused, by reason.
    """

    accepted: int = 0
    lost: int = 0
    seq_jumps: int = 0
    bytes_discarded: int = 0
    rejected: Counter[Rejection] = field(default_factory=Counter)

    def refused(self) -> dict[str, int]:
        """Return what was not passed on, by reason."""
        counts = {str(reason): count for reason, count in self.rejected.items()}
        return counts | {"lost": self.lost, "seq_jumps": self.seq_jumps, "bytes_discarded": self.bytes_discarded}

    def summary(self) -> str:
        """Return one line for messages and health reports."""
        reasons = ", ".join(f"{reason} {count}" for reason, count in sorted(self.rejected.items())) or "none"
        return (
            f"{self.accepted} samples accepted, {self.lost} lost, {self.bytes_discarded} bytes discarded, rejected: {reasons}"
        )
