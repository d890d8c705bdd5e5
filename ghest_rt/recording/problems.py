"""What was left out of a recording, and why: counted, never silent."""

from dataclasses import dataclass
from enum import StrEnum


class Skip(StrEnum):
    """Why part of a recording was not used."""

    TRUNCATED = "truncated"  # the file ends, or stops making sense, before its footer: used up to there
    DAMAGED_CHUNK = "damaged_chunk"  # checksum, compression or size does not agree
    DAMAGED_MESSAGE = "damaged_message"  # not decodable by its schema
    WRONG_SIZE = "wrong_size"  # an image whose size is not its calibration's
    WRONG_ENCODING = "wrong_encoding"  # an image in an encoding not accepted
    UNPAIRED_DEPTH = "unpaired_depth"  # a depth image without the colour image of the same number
    WRONG_JOINTS = "wrong_joints"  # an encoder sample for other joints than the first one's
    CHANGED_CAMERA = "changed_camera"  # calibration or facts that differ from the first ones


@dataclass(frozen=True, slots=True)
class Problem:
    """All skips of one kind on one topic.

    Attributes:
        skip: The kind.
        topic: The topic, or "" where it concerns the file.
        count: How many.
        byte: Where in the file the first one is (its chunk, for messages).
        t_ns: Arrival time of the first one, on the recording's clock; for a truncated file the last time before the cut.
        detail: What exactly, of the first one.
    """

    skip: Skip
    topic: str
    count: int
    byte: int
    t_ns: int
    detail: str

    def __str__(self) -> str:
        where = f"{self.topic} " if self.topic else ""
        return f"{where}{self.skip} x{self.count}: {self.detail} (first at byte {self.byte}, t = {self.t_ns * 1e-9:.6f} s)"


class ProblemLog:
    """Collects skips; keeps the first of each kind and topic, counts the rest."""

    def __init__(self) -> None:
        self._problems: dict[tuple[Skip, str], Problem] = {}

    def add(self, skip: Skip, topic: str, byte: int, t_ns: int, detail: str) -> None:
        """Count one skip."""
        first = self._problems.get((skip, topic))
        if first is None:
            self._problems[skip, topic] = Problem(skip, topic, 1, byte, t_ns, detail)
        else:
            self._problems[skip, topic] = Problem(skip, topic, first.count + 1, first.byte, first.t_ns, first.detail)

    def list(self) -> list[Problem]:
        """Return what was counted, in the order in which each kind first appeared."""
        return list(self._problems.values())
