"""Which sensor delivers which stream, in the mode asked for."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ghest_drivers.errors import DriverError
from ghest_drivers.hardware.realsense.sdk import rs


@dataclass(frozen=True, slots=True)
class Stream:
    """One stream of one sensor: SDK objects."""

    sensor: Any
    profile: Any


@dataclass(frozen=True, slots=True)
class Mode:
    """Size, format and rate asked for."""

    stream: Any
    format: Any
    width_px: int
    height_px: int
    rate_hz: int

    def __str__(self) -> str:
        return f"{self.stream.name} {self.format.name} {self.width_px}x{self.height_px} at {self.rate_hz} Hz"


def find_stream(sensors: list[Any], mode: Mode) -> Stream:
    """Return the first sensor and profile that offer `mode`.

    Raises:
        DriverError: None does; lists the modes of that stream and format.
    """
    offered = []
    for sensor, profile in _video_profiles(sensors, mode):
        here = Mode(mode.stream, mode.format, profile.width(), profile.height(), profile.fps())
        if here == mode:
            return Stream(sensor, profile)
        offered.append(f"{here.width_px}x{here.height_px} at {here.rate_hz} Hz")
    raise DriverError(f"the camera has no mode {mode}; it has: {', '.join(offered) or 'none of that format'}")


def group_by_sensor(streams: tuple[Stream, ...]) -> list[tuple[Any, list[Any]]]:
    """Return (sensor, profiles): colour and depth may come from one sensor (D405) or two (SR300)."""
    groups: list[tuple[Any, list[Any]]] = []
    for stream in streams:
        for sensor, profiles in groups:
            if sensor is stream.sensor:
                profiles.append(stream.profile)
                break
        else:
            groups.append((stream.sensor, [stream.profile]))
    return groups


def _video_profiles(sensors: list[Any], mode: Mode) -> Iterator[tuple[Any, Any]]:
    for sensor in sensors:
        for profile in sensor.get_stream_profiles():
            same = profile.stream_type() == mode.stream and profile.format() == mode.format
            if same and profile.is_video_stream_profile():
                yield sensor, profile.as_video_stream_profile()


def depth_unit_m(sensors: list[Any]) -> float:
    """Return metres per depth count, as the device states them.

    Raises:
        DriverError: No sensor states it.
    """
    for sensor in sensors:
        if sensor.supports(rs.option.depth_units):
            # The SDK keeps it in single precision: 0.000125 comes back as 0.000125000006.
            unit_m = float(f"{sensor.get_option(rs.option.depth_units):.7g}")
            if unit_m > 0:
                return unit_m
    raise DriverError("no sensor of this camera states its depth unit: is it a depth camera?")
