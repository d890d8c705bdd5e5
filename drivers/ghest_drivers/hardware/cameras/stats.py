"""Counters of one camera."""

from dataclasses import asdict, dataclass


@dataclass(slots=True)
class CameraStats:
    """Counters since the camera object was made; they survive re-opening.

    Attributes:
        delivered: Frames handed on.
        missing: Colour frames that the device counted and that never arrived.
        overruns: Frames thrown away because nobody read them in time.
        without_depth: Frames handed on with no depth image close enough in time.
        depth_unused: Depth images that no colour image was close to.
        repeated: Images that came again, or out of order.
        clock_suspect: Images whose device time contradicts all before it; not handed on.
        bad: Images of the wrong size or type.
    """

    delivered: int = 0
    missing: int = 0
    overruns: int = 0
    without_depth: int = 0
    depth_unused: int = 0
    repeated: int = 0
    clock_suspect: int = 0
    bad: int = 0

    def refused(self) -> dict[str, int]:
        """Return what was not handed on, or not whole, by reason."""
        counts = asdict(self)
        del counts["delivered"]
        return counts

    def summary(self) -> str:
        """Return one line for messages and health reports."""
        return ", ".join(f"{name} {count}" for name, count in asdict(self).items())
