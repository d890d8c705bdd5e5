"""What the simulated sensors are like: data, one entry per sensor."""

import math
from dataclasses import dataclass

import numpy as np

from ghest_drivers.samples import CameraInfo, Intrinsics
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import exp_so3


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraProfile:
    """An RGB-D camera.

    Attributes:
        model: What the simulated camera calls itself.
        color: Intrinsics of the colour image.
        depth: Intrinsics of the depth image.
        color_from_depth_m: Position of the depth camera in the colour camera frame.
        color_from_depth_rad: Its rotation vector there.
        rate_hz: Frame rate.
        depth_unit_m: Metres per depth count.
        range_m: Nearest and farthest depth measured.
        synchronous: Whether all cameras expose together, on the grid k / rate; otherwise each has its own phase.
        exposure_s: Exposure time.
        sub_exposures: How many instants of the exposure are averaged.
        supersampling: Samples per pixel side where a pixel holds an edge of the marker.
        background_step_px: Every how many pixels the background outside the marker's region is traced.
        color_noise: Standard deviation of a colour value, of 255.
        depth_noise_m: Standard deviation of a depth pixel.
        vignetting: Loss of brightness in the corners, 0-1.
        light_drift: Slow variation of brightness and of each channel's gain, 0-1.
        depth_holes: Whether depth is lost at grazing incidence and at edges.
        depth_delay_s: Depth image's mid-exposure after the colour image's.
        stamp_jitter_s: Standard deviation of the error of capture times.
        latency_s: Mid-exposure to delivery.
        latency_jitter_s: Standard deviation of that.
        clock_drift: Rate error of the camera's own clock.
    """

    model: str
    color: Intrinsics
    depth: Intrinsics
    color_from_depth_m: tuple[float, float, float]
    color_from_depth_rad: tuple[float, float, float]
    rate_hz: float
    depth_unit_m: float
    range_m: tuple[float, float]
    synchronous: bool
    exposure_s: float
    sub_exposures: int
    supersampling: int
    background_step_px: int
    color_noise: float
    depth_noise_m: float
    vignetting: float
    light_drift: float
    depth_holes: bool
    depth_delay_s: float
    stamp_jitter_s: float
    latency_s: float
    latency_jitter_s: float
    clock_drift: float

    @property
    def depth_is_registered(self) -> bool:
        """Whether the depth image is the colour image's, pixel by pixel."""
        return self.depth == self.color and not any(self.color_from_depth_m) and not any(self.color_from_depth_rad)

    def info(self, name: str) -> CameraInfo:
        """Return what a camera of this kind, called `name`, tells about itself."""
        return CameraInfo(
            name=name,
            model=self.model,
            serial=f"sim-{name}",
            color=self.color,
            depth=self.depth,
            depth_unit_m=self.depth_unit_m,
            color_from_depth=transform(exp_so3(np.array(self.color_from_depth_rad)), self.color_from_depth_m),
            rate_hz=self.rate_hz,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class EncoderProfile:
    """The encoder link: timing measured on exports of a real Armeo Spring (24,648 rows).

    Attributes:
        period_s: Mean time between rows, repeated rows included.
        period_sd_s: Standard deviation of the time between two proper rows.
        repeat_probability: Share of rows that repeat the one before.
        repeat_delay_s: A repeated row comes this long after the first at most.
        latency_s: Latch to delivery.
        bits: Resolution of a turn; None for ideal encoders.
        clock_drift: Rate error of the device's own clock.
    """

    period_s: float = 0.01560
    period_sd_s: float = 0.00066
    repeat_probability: float = 0.01
    repeat_delay_s: float = 0.002
    latency_s: float = 0.002
    bits: int | None = None
    clock_drift: float = 0.0


@dataclass(frozen=True, slots=True)
class SensorSet:
    """The sensors of one station.

    Attributes:
        name: As given on the command line.
        camera: Both cameras.
        encoders: The encoder link.
    """

    name: str
    camera: CameraProfile
    encoders: EncoderProfile


_PAPER_FOCAL_PX = 64.0 / math.tan(math.radians(22.5))
_PAPER_IMAGE = Intrinsics(128, 128, _PAPER_FOCAL_PX, _PAPER_FOCAL_PX, 63.5, 63.5)

PAPER = SensorSet(
    name="paper",
    camera=CameraProfile(
        model="Table 1",
        color=_PAPER_IMAGE,
        depth=_PAPER_IMAGE,
        color_from_depth_m=(0.0, 0.0, 0.0),
        color_from_depth_rad=(0.0, 0.0, 0.0),
        rate_hz=66.6,
        depth_unit_m=1e-5,
        range_m=(0.05, 0.3),
        synchronous=True,
        exposure_s=0.0,
        sub_exposures=1,
        supersampling=8,
        background_step_px=2,
        color_noise=0.0,
        depth_noise_m=0.0,
        vignetting=0.0,
        light_drift=0.0,
        depth_holes=False,
        depth_delay_s=0.0,
        stamp_jitter_s=0.0,
        latency_s=0.002,
        latency_jitter_s=0.0,
        clock_drift=0.0,
    ),
    encoders=EncoderProfile(),
)

SR300 = SensorSet(
    name="sr300",
    camera=CameraProfile(
        model="SR300-like",
        color=Intrinsics(640, 480, 475.0, 475.0, 318.7, 241.3, (0.06, -0.11, 0.0004, -0.0003, 0.0)),
        depth=Intrinsics(640, 480, 475.0, 475.0, 321.9, 238.6, (0.0, 0.0, 0.0, 0.0, 0.0)),
        color_from_depth_m=(0.0247, -0.0004, 0.0038),
        color_from_depth_rad=(0.004, -0.006, 0.002),
        rate_hz=60.0,
        depth_unit_m=0.000125,
        range_m=(0.2, 1.5),
        synchronous=False,
        exposure_s=0.008,
        sub_exposures=3,
        supersampling=4,
        background_step_px=4,
        color_noise=4.0,
        depth_noise_m=0.0005,
        vignetting=0.18,
        light_drift=0.06,
        depth_holes=True,
        depth_delay_s=0.003,
        stamp_jitter_s=0.00015,
        latency_s=0.022,
        latency_jitter_s=0.002,
        clock_drift=2.1e-5,
    ),
    encoders=EncoderProfile(bits=14, clock_drift=-1.3e-5),
)

SENSOR_SETS = {sensors.name: sensors for sensors in (PAPER, SR300)}


def find_sensors(name: str) -> SensorSet:
    """Return a sensor set by name.

    Raises:
        BadInputError: There is none of that name.
    """
    if name not in SENSOR_SETS:
        raise BadInputError(f"sensor {name!r} is unknown: give one of {', '.join(SENSOR_SETS)}")
    return SENSOR_SETS[name]
