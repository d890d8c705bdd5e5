"""Hardware cameras in the station file. docs/hardware.md has an example of each."""

from typing import Literal

from pydantic import Field

from ghest_rt.config.strict import Strict


class HardwareCamera(Strict):
    """What all hardware cameras have in common."""

    width_px: int = Field(default=640, ge=16, le=4096, description="Colour image")
    height_px: int = Field(default=480, ge=16, le=4096)
    rate_hz: int = Field(default=60, ge=1, le=300, description="Frames per second; the camera must offer it at this size")
    auto_exposure: bool = Field(default=False, description="Off by default: changing exposure shifts colours and capture times")
    exposure_us: int | None = Field(
        default=8000, ge=20, le=33_000, description="Fixed exposure; left out: as the camera has it"
    )
    supervised: bool = Field(
        default=True, description="Run the vendor's code in a process of its own, where it may hang or crash"
    )
    watchdog_ms: int = Field(default=500, ge=50, le=60_000, description="Without a frame for so long, that process is ended")


class RealsenseStreams(Strict):
    """Streams of a RealSense camera."""

    depth_width_px: int | None = Field(default=None, ge=16, le=4096, description="Left out: as colour")
    depth_height_px: int | None = Field(default=None, ge=16, le=4096)
    align: bool = Field(default=False, description="Resample depth into the colour image (15 ms a frame; not needed here)")


class RealsenseBackend(HardwareCamera, RealsenseStreams):
    """A RealSense camera (needs the extra `realsense`)."""

    backend: Literal["realsense"]
    serial: str = Field(min_length=1, description="Serial number as printed by `ghest-rt doctor`")
    laser_power: int | None = Field(default=None, ge=0, le=360, description="Projector, in the device's own steps")
    preset: str | None = Field(default=None, description="Name of a visual preset of the device")
    color_options: dict[str, float] = Field(default={}, description="More options of the colour sensor, by SDK name")
    depth_options: dict[str, float] = Field(default={}, description="More options of the depth sensor, by SDK name")
    latency_ms: float | None = Field(
        default=None, ge=0, le=200, description="From a frame's time stamp to its delivery; left out: one frame period"
    )
    record_bag: str | None = Field(default=None, description="Also record to this .bag file")


class RealsenseBagBackend(RealsenseStreams):
    """A .bag recording played back as if it were the camera (needs the extra `realsense`)."""

    backend: Literal["realsense_bag"]
    path: str = Field(description="The recording, relative to the station file")
    width_px: int = Field(default=640, ge=16, le=4096)
    height_px: int = Field(default=480, ge=16, le=4096)
    rate_hz: int = Field(default=60, ge=1, le=300)
    real_time: bool = Field(default=True, description="At the recorded pace; otherwise as fast as it is read")
    supervised: bool = False
    watchdog_ms: int = Field(default=500, ge=50, le=60_000)


class OakBackend(HardwareCamera):
    """An OAK-D SR or OAK-D (needs the extra `oak`)."""

    backend: Literal["oak"]
    mxid: str = Field(min_length=1, description="Id as printed by `ghest-rt doctor`")
    sensitivity_iso: int = Field(default=400, ge=100, le=1600, description="Goes with exposure_us")
    extended_disparity: bool = Field(default=True, description="Half the least distance")


HardwareCameraBackend = RealsenseBackend | RealsenseBagBackend | OakBackend
