"""How each device backend is chosen and set up in the station file."""

from typing import Literal

from pydantic import Field

from ghest_rt.config.camera_devices import HardwareCameraBackend
from ghest_rt.config.encoder_devices import HardwareEncoderBackend
from ghest_rt.config.strict import Strict


class SimBackend(Strict):
    """A device of the simulated clinic (needs the extra `sim`)."""

    backend: Literal["sim"]
    sensor: Literal["paper", "sr300"] = Field(default="paper", description="What a live run simulates")


class ReplayBackend(Strict):
    """A device read back from the recording given on the command line."""

    backend: Literal["replay"]


CameraBackend = SimBackend | ReplayBackend | HardwareCameraBackend
EncoderBackend = SimBackend | ReplayBackend | HardwareEncoderBackend
