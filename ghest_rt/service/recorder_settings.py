"""How a live recording is made, and what it came to."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True, slots=True)
class RecorderSettings:
    """How a live recording is made.

    Attributes:
        part_bytes: A file that has grown to this size is followed by another.
        part_ns: So is one that covers this time.
        flush_ns: How long what was written may stay in this process: the end of the process loses no more.
        sync_ns: From one time that the disk is made to take what was written to the next: so much a power failure loses.
        queue_bytes: What may wait for the disk; beyond it frames are dropped. At 2 x 640x480 at 60 Hz: 0.8 s.
        compress: Smaller files (zstd) for more processor time; the content is the same.
        recipients: Public keys that the files are sealed for; none for plain files.
        drain_s: How long the end of a run waits for the disk.
    """

    part_bytes: int = 4_000_000_000
    part_ns: int = 600_000_000_000
    flush_ns: int = 200_000_000
    sync_ns: int = 500_000_000
    queue_bytes: int = 150_000_000
    compress: bool = False
    recipients: tuple[str, ...] = ()
    drain_s: float = 10.0


@dataclass(slots=True)
class RecorderCounts:
    """What a recorder has done so far.

    Attributes:
        written: Messages written, by topic.
        dropped: Messages left out, by topic: because the disk was slower than the data, or after it failed.
        written_bytes: Size of all files.
        max_wait_ns: The longest that anything waited from its arrival at the recorder until it was written.
        parts: The files, in order.
        failure: Why recording stopped before the end; "" if it did not.
    """

    written: dict[str, int] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)
    written_bytes: int = 0
    max_wait_ns: int = 0
    parts: list[Path] = field(default_factory=list)
    failure: str = ""


def drops_in_words(dropped: Mapping[str, int]) -> str:
    """Return the drops in one phrase, by topic; "" if there are none."""
    return ", ".join(f"{count} on {topic}" for topic, count in sorted(dropped.items()))
