"""DepthAI messages to `RgbdFrame`s. Needs no device: works on the SDK's own message types, wherever they come from."""

from dataclasses import replace
from datetime import timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ghest_drivers.clock_sync import ClockMap
from ghest_drivers.errors import BadDeviceData
from ghest_drivers.hardware.cameras.distortion import PlumbBob, fit_plumb_bob, image_grid
from ghest_drivers.hardware.cameras.numbering import FrameNumbering
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.hardware.oak.sdk import dai
from ghest_drivers.samples import CameraInfo, Intrinsics, RgbdFrame

_MAX_AGE_NS = 1_000_000_000
_MAX_FIT_ERROR_PX = 0.25
_COEFFICIENTS = 14
_MIN_FOCAL_WIDTHS = 0.1  # a focal length shorter than this many image widths is no calibration


def nanoseconds(time: timedelta) -> int:
    """Return a time of the SDK (microsecond steps) in nanoseconds."""
    return (time.days * 86_400 + time.seconds) * 1_000_000_000 + time.microseconds * 1000


class GroupConverter:
    """Turns pairs of synchronised images into frames. One thread at a time.

    The SDK stamps images in its own host clock, already fitted to the device's; that is CLOCK_MONOTONIC, and
    `host_offset_ns` covers the case that it were another. A stamp that cannot be (in the future, or older than a second:
    the SDK's fit has not settled, or was lost) is replaced by the fit of this driver to the device time.

    Args:
        info: The camera; its intrinsics are replaced by those that the first image carries.
        host_offset_ns: Host monotonic time less the SDK's host time.
        stats: What happened.
    """

    def __init__(self, info: CameraInfo, host_offset_ns: int, stats: CameraStats) -> None:
        self._info = info
        self._calibrated = False
        self._host_offset_ns = host_offset_ns
        self._clock = ClockMap()
        self._numbering = FrameNumbering(stats)
        self._stats = stats
        self._last_capture_ns: int | None = None

    def convert(self, color: "dai.ImgFrame", depth: "dai.ImgFrame | None", t_arrival_ns: int) -> RgbdFrame | None:
        """Return the frame; None, counted, if its time is not believable or not later than the last one's.

        Raises:
            BadDeviceData: Wrong type or size, or depth that is not aligned to colour.
        """
        t_capture_ns = self._capture_ns(color, t_arrival_ns)
        if t_capture_ns is None:
            self._stats.clock_suspect += 1
            return None
        if self._last_capture_ns is not None and t_capture_ns <= self._last_capture_ns:
            self._stats.repeated += 1
            return None
        self._last_capture_ns = t_capture_ns
        seq = self._numbering.next(color.getSequenceNum())
        color_rgb, depth_counts = self._images(color, depth)
        if not self._calibrated:
            self._calibrate(color, depth)
        self._stats.delivered += 1
        between_ns = 0 if depth is None else nanoseconds(_middle(depth)) - nanoseconds(_middle(color))
        return RgbdFrame(
            info=self._info,
            seq=seq,
            color_rgb=color_rgb,
            depth_counts=depth_counts,
            t_device_ns=nanoseconds(color.getTimestampDevice()),
            t_arrival_ns=t_arrival_ns,
            t_capture_ns=t_capture_ns,
            t_depth_capture_ns=min(t_capture_ns + between_ns, t_arrival_ns),
        )

    def _capture_ns(self, color: "dai.ImgFrame", t_arrival_ns: int) -> int | None:
        to_middle_ns = nanoseconds(_middle(color)) - nanoseconds(color.getTimestamp())
        fitted_ns = self._clock.stamp(nanoseconds(color.getTimestampDevice()) + to_middle_ns, t_arrival_ns)
        t_capture_ns = nanoseconds(_middle(color)) + self._host_offset_ns
        return t_capture_ns if 0 <= t_arrival_ns - t_capture_ns <= _MAX_AGE_NS else fitted_ns

    def _images(
        self, color: "dai.ImgFrame", depth: "dai.ImgFrame | None"
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint16] | None]:
        expected = (self._info.color.height_px, self._info.color.width_px)
        for what, image, wanted in (
            ("colour", color, dai.ImgFrame.Type.RGB888i),
            ("depth", depth, dai.ImgFrame.Type.RAW16),
        ):
            if image is None:
                continue
            size = (image.getHeight(), image.getWidth())
            if image.getType() != wanted or size != expected:
                self._stats.bad += 1
                raise BadDeviceData(
                    f"camera {self._info.name}: {what} image {image.getSequenceNum()} is {image.getType().name} {size}, "
                    f"not {wanted.name} {expected}"
                )
        depth_counts = None if depth is None else _pixels(depth, expected, np.dtype(np.uint16))
        return _pixels(color, (*expected, 3), np.dtype(np.uint8)), depth_counts

    def _calibrate(self, color: "dai.ImgFrame", depth: "dai.ImgFrame | None") -> None:
        if depth is not None and not depth.getTransformation().isAlignedTo(color.getTransformation()):
            raise BadDeviceData(f"camera {self._info.name}: the depth image is not aligned to the colour image")
        intrinsics = intrinsics_of(color)
        self._info = replace(self._info, color=intrinsics, depth=intrinsics)
        self._calibrated = True

    @property
    def info(self) -> CameraInfo:
        """The camera, with its calibration once a frame was converted."""
        return self._info


def intrinsics_of(image: "dai.ImgFrame") -> Intrinsics:
    """Return the intrinsics that an image carries, whatever was cropped and scaled on its way.

    Raises:
        BadDeviceData: It carries none, or a lens that the plumb-bob model does not match.
    """
    transformation: Any = image.getTransformation()
    (fx, _, cx), (_, fy, cy), _ = transformation.getIntrinsicMatrix()
    width_px, height_px = image.getWidth(), image.getHeight()
    if not (_MIN_FOCAL_WIDTHS * width_px < fx < np.inf and _MIN_FOCAL_WIDTHS * width_px < fy < np.inf):
        raise BadDeviceData("the images carry no calibration: has this OAK been calibrated?")
    if transformation.getDistortionModel() != dai.CameraModel.Perspective:
        raise BadDeviceData(f"lens model {transformation.getDistortionModel().name} has no counterpart")
    grid = (image_grid(width_px, height_px) - (cx, cy)) / (fx, fy)
    distortion = _plumb_bob(list(transformation.getDistortionCoefficients()), grid, max(fx, fy))
    return Intrinsics(width_px, height_px, float(fx), float(fy), float(cx), float(cy), distortion)


def _plumb_bob(given: list[float], ideal: NDArray[np.float64], focal_px: float) -> PlumbBob:
    """Fit DepthAI's (OpenCV's rational) model k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 τx τy by its first five terms."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y = (given + [0.0] * _COEFFICIENTS)[:_COEFFICIENTS]
    if not any((k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y)):
        return (k1, k2, p1, p2, k3)
    if tau_x or tau_y:
        raise BadDeviceData("a tilted sensor (τx, τy) has no counterpart: have the device undistort its images")
    x, y = ideal[:, 0], ideal[:, 1]
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    distorted = np.column_stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + s1 * r2 + s2 * r2**2,
            y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y) + s3 * r2 + s4 * r2**2,
        ]
    )
    fit = fit_plumb_bob(ideal, distorted, focal_px)
    if fit.max_error_px > _MAX_FIT_ERROR_PX:
        raise BadDeviceData(
            f"the lens model is matched only to {fit.max_error_px:.2f} px: have the device undistort its images"
        )
    return fit.coefficients


def _middle(image: "dai.ImgFrame") -> timedelta:
    middle: timedelta = image.getTimestamp(dai.CameraExposureOffset.MIDDLE)
    return middle


def _pixels(image: "dai.ImgFrame", shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return a copy of the pixels, without what pads the rows."""
    row_bytes = int(np.prod(shape[1:])) * dtype.itemsize
    stride = image.getStride() or row_bytes
    data = np.asarray(image.getData()).view(np.uint8).ravel()
    if stride < row_bytes or len(data) < stride * (shape[0] - 1) + row_bytes:
        raise BadDeviceData(f"image {image.getSequenceNum()} holds {len(data)} bytes, not {shape[0]} rows of {row_bytes}")
    if stride == row_bytes:
        return data[: shape[0] * row_bytes].view(dtype).reshape(shape).copy()
    padded = np.zeros(shape[0] * stride, np.uint8)
    padded[: len(data)] = data[: len(padded)]
    return padded.reshape(shape[0], stride)[:, :row_bytes].copy().view(dtype).reshape(shape)
