"""Where mid-exposure lies with respect to a frame's time stamp."""

from typing import Any

from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.settings import RealsenseSettings

_SENSOR_TIME = rs.frame_metadata_value.sensor_timestamp
_FRAME_TIME = rs.frame_metadata_value.frame_timestamp


class MidExposure:
    """Finds the offset, in this order: the frame's own metadata; half the fixed exposure; nothing.

    With metadata, `sensor_timestamp` is mid-exposure and `frame_timestamp` the stamped read-out, both microseconds of the
    hardware clock. Without, the stamp is taken for the end of the exposure.
    """

    def __init__(self, settings: RealsenseSettings) -> None:
        fixed_us = 0 if settings.auto_exposure or settings.exposure_us is None else settings.exposure_us
        self._fixed_ns = -fixed_us * 500
        self._limit_ns = 4 * settings.period_ns

    def offset_ns(self, frame: Any) -> int:
        """Return mid-exposure less the stamped instant, never positive."""
        if frame.supports_frame_metadata(_SENSOR_TIME) and frame.supports_frame_metadata(_FRAME_TIME):
            offset_ns = 1000 * (frame.get_frame_metadata(_SENSOR_TIME) - frame.get_frame_metadata(_FRAME_TIME))
            if -self._limit_ns <= offset_ns <= 0:
                return int(offset_ns)
        return self._fixed_ns
