"""What devices deliver. Frozen, slotted, arrays read-only by convention; times are host monotonic nanoseconds.

Every sample carries three times: `t_device_ns` (the device's own clock, raw), `t_arrival_ns` (host clock at delivery) and
`t_capture_ns` (host clock estimate of mid-exposure, or of the encoder latch): the only one that the maths uses.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """Pinhole camera with OpenCV's plumb-bob distortion; pixel (0, 0) is the *centre* of the top left pixel.

    Attributes:
        width_px: Image width.
        height_px: Image height.
        fx_px: Focal length along u.
        fy_px: Focal length along v.
        cx_px: Principal point, u.
        cy_px: Principal point, v.
        distortion: (k1, k2, p1, p2, k3), all zero for an ideal pinhole.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The 3x3 camera matrix K."""
        return np.array([[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True)
class DeviceVitals:
    """How a device says it is doing.

    Attributes:
        refused: What it or its driver did not pass on since the start, by reason; reasons that never occurred may be absent.
        temperature_c: Its temperature, degrees Celsius; None where it does not tell.
    """

    refused: Mapping[str, int] = field(default_factory=dict)
    temperature_c: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class CameraInfo:
    """What is fixed while a camera is open.

    Attributes:
        name: The camera's name in the station file ("r0", "r1").
        model: Vendor's model name, or the simulated sensor's.
        serial: Serial number.
        color: Intrinsics of the colour image.
        depth: Intrinsics of the depth image.
        depth_unit_m: Metres per depth count.
        color_from_depth: (4, 4) pose of the depth camera in the colour camera frame; identity where depth is registered.
        rate_hz: Nominal frame rate.
    """

    name: str
    model: str
    serial: str
    color: Intrinsics
    depth: Intrinsics
    depth_unit_m: float
    color_from_depth: NDArray[np.float64]
    rate_hz: float


@dataclass(frozen=True, slots=True, eq=False)
class RgbdFrame:
    """One colour image and the depth image paired with it.

    Attributes:
        info: The camera it came from.
        seq: Counts the camera's frames; a gap is a dropped frame.
        color_rgb: (H, W, 3) uint8, R G B.
        depth_counts: (h, w) uint16 in `info.depth_unit_m`, 0 where there is no measurement; None if there is no depth image.
        t_device_ns: Raw device time of the colour image.
        t_arrival_ns: Host time of delivery.
        t_capture_ns: Host time of the colour image's mid-exposure.
        t_depth_capture_ns: Host time of the depth image's mid-exposure.
    """

    info: CameraInfo
    seq: int
    color_rgb: NDArray[np.uint8]
    depth_counts: NDArray[np.uint16] | None
    t_device_ns: int
    t_arrival_ns: int
    t_capture_ns: int
    t_depth_capture_ns: int


@dataclass(frozen=True, slots=True)
class EncoderInfo:
    """What is fixed while an encoder link is open.

    Attributes:
        name: The link's name ("encoders").
        joint_names: The joints measured, in the order of `EncoderSample.angles_rad`.
    """

    name: str
    joint_names: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class EncoderSample:
    """All joint encoders, latched at one instant.

    Attributes:
        seq: Counts samples as sent by the device; a gap is a lost sample.
        angles_rad: (n,) float64, in the order of `EncoderInfo.joint_names`.
        t_device_ns: Raw device time of the latch.
        t_arrival_ns: Host time of delivery.
        t_capture_ns: Host time of the latch.
    """

    seq: int
    angles_rad: NDArray[np.float64]
    t_device_ns: int
    t_arrival_ns: int
    t_capture_ns: int
