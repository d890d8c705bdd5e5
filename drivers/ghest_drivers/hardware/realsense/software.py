"""A RealSense device in software: the SDK's own, fed with frames. It runs the whole driver where no camera is.

The SDK cannot give such a device's *live* frames a depth unit, but the sensor states it, and a .bag made from it is complete.
"""

import gc
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ghest_drivers.clock import Clock
from ghest_drivers.hardware.realsense.sdk import rs
from ghest_drivers.hardware.realsense.timestamps import TimeDomain
from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame

Range = tuple[float, float, float]


class SoftwareRealsense:
    """Two sensors, laid out as in an SR300, with the calibration of `info`.

    Args:
        info: Model, serial, intrinsics (plumb-bob), depth unit, extrinsics and rate to state.
        color_options: Options of the colour sensor by SDK name: (least, greatest, default).
        depth_options: Likewise for the depth sensor.
    """

    def __init__(
        self,
        info: CameraInfo,
        color_options: Mapping[str, Range] | None = None,
        depth_options: Mapping[str, Range] | None = None,
    ) -> None:
        self.device = rs.software_device()
        self.device.register_info(rs.camera_info.name, info.model)
        self.device.register_info(rs.camera_info.serial_number, info.serial)
        self._depth_sensor = self.device.add_sensor("Coded-Light Depth Sensor")
        self._color_sensor = self.device.add_sensor("RGB Camera")
        rate_hz = round(info.rate_hz)
        depth = _video_stream(rs.stream.depth, rs.format.z16, info.depth, rate_hz)
        color = _video_stream(rs.stream.color, rs.format.rgb8, info.color, rate_hz)
        self._depth_profile = self._depth_sensor.add_video_stream(depth).as_video_stream_profile()
        self._color_profile = self._color_sensor.add_video_stream(color).as_video_stream_profile()
        self._depth_profile.register_extrinsics_to(self._color_profile, _extrinsics(info.color_from_depth))
        self._depth_sensor.add_read_only_option(rs.option.depth_units, info.depth_unit_m)
        for sensor, options in ((self._color_sensor, color_options), (self._depth_sensor, depth_options)):
            for name, (least, greatest, default) in (options or {}).items():
                limits = rs.option_range()
                limits.min, limits.max, limits.step, limits.default = least, greatest, 1.0, default
                sensor.add_option(getattr(rs.option, name), limits, True)

    def context(self) -> Any:
        """Return a new SDK context in which this device is found."""
        context = rs.context()
        self.device.add_to(context)
        return context

    def send_color(self, color_rgb: NDArray[np.uint8], number: int, t_device_ns: int, domain: TimeDomain) -> None:
        """Deliver a colour frame, with the time stamp given, to whoever has started the sensor."""
        _send(self._color_sensor, color_rgb, _stamped(self._color_profile, number, t_device_ns, domain))

    def send_depth(self, counts: NDArray[np.uint16], number: int, t_device_ns: int, domain: TimeDomain) -> None:
        """Deliver a depth frame likewise."""
        _send(self._depth_sensor, counts, _stamped(self._depth_profile, number, t_device_ns, domain))

    def set_metadata(self, name: str, value: int) -> None:
        """Set a metadata field, by SDK name, of all later frames."""
        for sensor in (self._color_sensor, self._depth_sensor):
            sensor.set_metadata(getattr(rs.frame_metadata_value, name), value)

    def set_option(self, name: str, value: float) -> None:
        """Set an option of whichever sensor has it."""
        for sensor in (self._color_sensor, self._depth_sensor):
            if sensor.supports(getattr(rs.option, name)):
                sensor.set_option(getattr(rs.option, name), value)

    def option(self, name: str) -> tuple[float | None, float | None]:
        """Return an option's value at the colour and at the depth sensor, None where there is none."""
        key = getattr(rs.option, name)
        color, depth = (
            float(sensor.get_option(key)) if sensor.supports(key) else None
            for sensor in (self._color_sensor, self._depth_sensor)
        )
        return color, depth


def write_bag(path: Path, info: CameraInfo, frames: Iterable[RgbdFrame], clock: Clock) -> int:
    """Record frames to a .bag with the SDK's recorder; return how many.

    The SDK keeps the time at which it was handed each frame for real-time playback: `clock` paces the writing by the
    frames' capture times. A frame's stamp is its capture time, on the hardware clock.
    """
    device = SoftwareRealsense(info)
    recorder = rs.recorder(str(path), device.device)
    sensors = list(recorder.query_sensors())
    for sensor in sensors:
        sensor.open(sensor.get_stream_profiles()[0])
        sensor.start(_ignore)
    start_ns: int | None = None
    count = 0
    for frame in frames:
        start_ns = clock.now_ns() - frame.t_capture_ns if start_ns is None else start_ns
        clock.sleep_until_ns(start_ns + frame.t_capture_ns)
        if frame.depth_counts is not None:
            device.send_depth(frame.depth_counts, frame.seq, frame.t_depth_capture_ns, TimeDomain.HARDWARE)
        device.send_color(frame.color_rgb, frame.seq, frame.t_capture_ns, TimeDomain.HARDWARE)
        count += 1
    while sensors:
        sensor = sensors.pop()
        sensor.stop()
        sensor.close()
    del sensor, recorder  # the file is only complete once the recorder has gone
    gc.collect()
    return count


def _ignore(frame: Any) -> None:
    """The recorder has seen it."""


def _video_stream(stream: Any, fmt: Any, camera: Intrinsics, rate_hz: int) -> Any:
    raw = rs.intrinsics()
    raw.width, raw.height = camera.width_px, camera.height_px
    raw.fx, raw.fy, raw.ppx, raw.ppy = camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px
    raw.model = rs.distortion.brown_conrady if any(camera.distortion) else rs.distortion.none
    raw.coeffs = list(camera.distortion)
    video = rs.video_stream()
    video.type, video.fmt, video.bpp = stream, fmt, 3 if fmt == rs.format.rgb8 else 2
    video.uid, video.index = int(stream), 0
    video.width, video.height, video.fps = camera.width_px, camera.height_px, rate_hz
    video.intrinsics = raw
    return video


def _extrinsics(color_from_depth: NDArray[np.float64]) -> Any:
    raw = rs.extrinsics()
    raw.rotation = [float(value) for value in color_from_depth[:3, :3].T.ravel()]
    raw.translation = [float(value) for value in color_from_depth[:3, 3]]
    return raw


def _stamped(profile: Any, number: int, t_device_ns: int, domain: TimeDomain) -> Any:
    frame = rs.software_video_frame()
    frame.timestamp = t_device_ns * 1e-6
    frame.domain = getattr(rs.timestamp_domain, domain.value)
    frame.frame_number = number
    frame.profile = profile
    return frame


def _send(sensor: Any, pixels: NDArray[Any], frame: Any) -> None:
    frame.pixels = np.ascontiguousarray(pixels)
    frame.bpp = pixels.itemsize * (pixels.shape[2] if pixels.ndim == 3 else 1)
    frame.stride = pixels.shape[1] * frame.bpp
    sensor.on_video_frame(frame)
