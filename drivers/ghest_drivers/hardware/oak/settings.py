"""How an OAK camera is set up."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class OakSettings:
    """Streams and options of one camera.

    Attributes:
        width_px: Width of the colour image, and of the depth image aligned to it.
        height_px: Height likewise.
        rate_hz: Frame rate.
        depth: Compute depth, too; without, frames have none and the device needs no stereo pair.
        auto_exposure: Let the camera choose exposure times.
        exposure_us: Fixed exposure, if not automatic; None: as the camera has it.
        sensitivity_iso: Fixed sensitivity that goes with `exposure_us`.
        extended_disparity: Search twice the disparity range: halves the least distance, costs half the rate.
        queue_frames: Frames held for a reader that is late, and in the SDK's own queues.
    """

    width_px: int = 640
    height_px: int = 480
    rate_hz: int = 60
    depth: bool = True
    auto_exposure: bool = False
    exposure_us: int | None = 8000
    sensitivity_iso: int = 400
    extended_disparity: bool = True
    queue_frames: int = 4

    @property
    def period_ns(self) -> int:
        """The frame period."""
        return round(1e9 / self.rate_hz)
