"""How each device backend is chosen and set up in the station file."""

from typing import Literal

from pydantic import Field

from ghest_rt.config.encoder_devices import HardwareEncoderBackend
from ghest_rt.config.strict import Strict


class SimBackend(Strict):
    """A device of the simulated clinic (needs the extra `sim`)."""

    backend: Literal["sim"]
    sensor: Literal["paper", "sr300"] = Field(default="paper", description="What a live run simulates")


class ReplayBackend(Strict):
    """A device read back from the recording given on the command line."""

    backend: Literal["replay"]


class RealsenseBackend(Strict):
    """A RealSense camera (needs the extra `realsense`)."""

    backend: Literal["realsense"]
    serial: str = Field(description="Serial number as printed by `ghest-rt doctor`")
    width_px: int = 640
    height_px: int = 480
    rate_hz: Literal[30, 60] = 60
    auto_exposure: bool = False
    exposure_us: int | None = Field(default=8000, ge=20, le=33000)
    laser_power: int | None = Field(default=None, ge=0, le=16)


CameraBackend = SimBackend | ReplayBackend | RealsenseBackend
EncoderBackend = SimBackend | ReplayBackend | HardwareEncoderBackend
