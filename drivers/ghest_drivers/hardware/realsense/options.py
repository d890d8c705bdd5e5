"""Sensor options: checked against what the sensor offers before they are set."""

import logging
from collections.abc import Mapping
from typing import Any

from ghest_drivers.errors import DriverError
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.settings import RealsenseSettings

_log = logging.getLogger(__name__)
_UVC_EXPOSURE_UNIT_US = 100
_MAX_PRESETS = 100


def apply_options(color_sensor: Any, depth_sensor: Any, settings: RealsenseSettings) -> None:
    """Set up both sensors; the preset first, since it changes the others.

    Args:
        color_sensor: The sensor that streams colour.
        depth_sensor: The one that streams depth; None if none does.
        settings: What to set.

    Raises:
        DriverError: Something is asked for of depth that is not streamed; the sensor lacks an option, or the value is out of
            its range; says which values it takes.
    """
    for sensor in (color_sensor, depth_sensor):
        if sensor is not None:
            _stamp_by_the_device(sensor)
    if depth_sensor is None:
        if settings.preset is not None or settings.laser_power is not None or settings.depth_options:
            raise DriverError("preset, laser_power and depth_options need depth: leave them out, or stream depth")
        _set_exposure(color_sensor, settings)
        _set_all(color_sensor, settings.color_options)
        return
    if settings.preset is not None:
        _set(depth_sensor, "visual_preset", _preset_value(depth_sensor, settings.preset))
    _set_exposure(color_sensor, settings)
    if settings.laser_power is not None:
        _set(depth_sensor, "laser_power", settings.laser_power)
    _set_all(color_sensor, settings.color_options)
    _set_all(depth_sensor, settings.depth_options)


def _stamp_by_the_device(sensor: Any) -> None:
    """Turn the SDK's `global time` off, its mapping of stamps to the wall clock: that goes astray when NTP steps the clock."""
    if sensor.supports(rs.option.global_time_enabled):
        try:
            sensor.set_option(rs.option.global_time_enabled, 0.0)
        except RuntimeError as error:
            _log.warning("%s keeps stamping by the wall clock: %s", _name(sensor), error)


def exposure_unit_us(sensor: Any) -> int:
    """Return the unit of a sensor's exposure option: separate colour sensors count 100 µs (UVC), stereo modules 1 µs."""
    name = sensor.get_info(rs.camera_info.name) if sensor.supports(rs.camera_info.name) else ""
    return _UVC_EXPOSURE_UNIT_US if "RGB" in name or "Color" in name else 1


def _set_exposure(sensor: Any, settings: RealsenseSettings) -> None:
    if sensor.supports(rs.option.enable_auto_exposure):
        _set(sensor, "enable_auto_exposure", float(settings.auto_exposure))
    elif settings.auto_exposure:
        raise DriverError(f"{_name(sensor)} has no automatic exposure: set auto_exposure = false")
    if not settings.auto_exposure and settings.exposure_us is not None:
        if not sensor.supports(rs.option.exposure):
            _log.warning("%s has no exposure option: exposure_us is not used", _name(sensor))
            return
        _set(sensor, "exposure", settings.exposure_us / exposure_unit_us(sensor))


def _preset_value(sensor: Any, name: str) -> float:
    if not sensor.supports(rs.option.visual_preset):
        raise DriverError(f"{_name(sensor)} has no presets: remove preset")
    known = []
    limits = sensor.get_option_range(rs.option.visual_preset)
    for index in range(min(int(limits.max) + 1, _MAX_PRESETS)):
        description = sensor.get_option_value_description(rs.option.visual_preset, float(index))
        if description is None:
            continue
        if description.casefold() == name.casefold():
            return float(index)
        known.append(description)
    raise DriverError(f"{_name(sensor)} has no preset {name!r}; it has: {', '.join(known) or 'none'}")


def _set_all(sensor: Any, options: Mapping[str, float]) -> None:
    for name, value in options.items():
        _set(sensor, name, value)


def _set(sensor: Any, name: str, value: float) -> None:
    option = rs.option.__members__.get(name)
    if option is None or not sensor.supports(option):
        offered = ", ".join(sorted(known.name for known in sensor.get_supported_options()))
        raise DriverError(f"{_name(sensor)} has no option {name!r}; it has: {offered}")
    limits = sensor.get_option_range(option)
    if not limits.min <= value <= limits.max:
        raise DriverError(f"{_name(sensor)}: {name} = {value:g} is outside {limits.min:g} to {limits.max:g}")
    try:
        sensor.set_option(option, value)
    except RuntimeError as error:
        raise DriverError(f"{_name(sensor)} refused {name} = {value:g}: {error}") from error


def _name(sensor: Any) -> str:
    return str(sensor.get_info(rs.camera_info.name)) if sensor.supports(rs.camera_info.name) else "the sensor"
