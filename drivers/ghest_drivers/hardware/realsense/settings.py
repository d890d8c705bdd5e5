"""How a RealSense camera is set up."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True, slots=True)
class RealsenseSettings:
    """Streams, options and times of one camera.

    Attributes:
        width_px: Colour image width.
        height_px: Colour image height.
        depth_width_px: Depth image width; None: as colour.
        depth_height_px: Depth image height; None: as colour.
        rate_hz: Frame rate of both streams.
        depth: Stream depth, too; without, frames have none and the device needs none.
        align: Resample depth into the colour image; otherwise depth stays as measured, with its own intrinsics and
            `color_from_depth` (better: nothing is rounded).
        auto_exposure: Let the camera choose exposure times.
        exposure_us: Fixed exposure, if not automatic; None: as the camera has it.
        laser_power: Projector power in the device's own steps; None: as the camera has it.
        preset: Name of the device's visual preset, set before all other options; None: as the camera has it.
        color_options: Further options of the colour sensor by SDK name ("gain").
        depth_options: Further options of the depth sensor by SDK name.
        latency_ns: Least time from a frame's device time stamp to its delivery, taken off every capture time that comes
            from the hardware clock; None: one frame period, since a frame takes about that long to be read out and sent.
        queue_frames: Frames held for a reader that is late.
        record_bag: Also record everything to this .bag file.
    """

    width_px: int = 640
    height_px: int = 480
    depth_width_px: int | None = None
    depth_height_px: int | None = None
    rate_hz: int = 60
    depth: bool = True
    align: bool = False
    auto_exposure: bool = False
    exposure_us: int | None = 8000
    laser_power: float | None = None
    preset: str | None = None
    color_options: Mapping[str, float] = field(default_factory=dict)
    depth_options: Mapping[str, float] = field(default_factory=dict)
    latency_ns: int | None = None
    queue_frames: int = 4
    record_bag: Path | None = None

    @property
    def period_ns(self) -> int:
        """The frame period."""
        return round(1e9 / self.rate_hz)
