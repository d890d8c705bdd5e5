"""The project's own messages in a recording: JSON rows with a JSON Schema, to and from the dataclasses used inside."""

import json
import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from ghest_drivers.samples import CameraInfo, EncoderSample, Intrinsics
from ghest_rt.geometry.se3 import rigidity_problem, transform
from ghest_rt.messages.results import TruthSample

Array = NDArray[np.float64]
Row3 = tuple[float, float, float]
Row4 = tuple[float, float, float, float]
Matrix3 = tuple[Row3, Row3, Row3]
Matrix4 = tuple[Row4, Row4, Row4, Row4]
Count = Annotated[int, Field(ge=0)]
TimeNs = Annotated[int, Field(ge=-(2**63), lt=2**63)]


class Row(BaseModel):
    """One JSON message. Unknown keys are ignored, so that others may add their own."""

    model_config = ConfigDict(frozen=True, strict=True, allow_inf_nan=False)


class CameraRow(Row):
    """Schema `ghest.CameraInfo`: what is fixed about a camera, beside its two calibrations."""

    name: str
    model: str
    serial: str
    depth_unit_m: float = Field(gt=0.0, lt=1.0, description="Metres per depth count")
    color_from_depth: Matrix4 = Field(description="Pose of the depth camera in the colour camera frame, row by row, metres")
    rate_hz: float = Field(gt=0.0, description="Nominal frame rate")


class DeviceTimeRow(Row):
    """Schema `ghest.DeviceTime`: the camera's own time of the frame with this number."""

    seq: Count
    t_device_ns: TimeNs


class EncoderRow(Row):
    """Schema `ghest.EncoderSample`: all joint encoders, latched at one instant."""

    seq: Count
    t_device_ns: TimeNs = Field(description="Time of the latch on the device's own clock")
    t_capture_ns: TimeNs = Field(description="Time of the latch on the recording's clock")
    names: tuple[str, ...] = Field(min_length=1, max_length=256)
    angles_rad: tuple[float | None, ...] = Field(description="In the order of names; null where the encoder gave no number")


class TruthRow(Row):
    """Schema `ghest.Truth`: where everything really is, in a simulation; matrices row by row, metres."""

    t_ns: TimeNs
    gh_from_arm: Matrix3
    m0_from_arm: Matrix4
    e_from_m0: Matrix4
    e_from_m1: Matrix4
    e_from_arm: Matrix4
    joints_rad: dict[str, float] = Field(description="True joint positions; metres for prismatic joints")
    elbow_rad: tuple[float, float] | None = Field(default=None, description="The patient's elbow flexion and pronation")


def json_schema(row: type[Row]) -> bytes:
    """Return the JSON Schema of a row."""
    return json.dumps(row.model_json_schema(), sort_keys=True).encode()


def camera_to_json(info: CameraInfo) -> bytes:
    """Encode a camera's facts."""
    row = CameraRow(
        name=info.name,
        model=info.model,
        serial=info.serial,
        depth_unit_m=info.depth_unit_m,
        color_from_depth=_rows4(info.color_from_depth),
        rate_hz=info.rate_hz,
    )
    return row.model_dump_json().encode()


def camera_from_json(data: bytes | memoryview, color: Intrinsics, depth: Intrinsics) -> CameraInfo:
    """Decode a camera's facts and join them with its calibrations.

    Raises:
        ValueError: Not such a row, or the pose of the depth camera is not rigid.
    """
    row = CameraRow.model_validate_json(bytes(data))
    return CameraInfo(
        name=row.name,
        model=row.model,
        serial=row.serial,
        color=color,
        depth=depth,
        depth_unit_m=row.depth_unit_m,
        color_from_depth=_rigid("color_from_depth", row.color_from_depth),
        rate_hz=row.rate_hz,
    )


def device_time_to_json(seq: int, t_device_ns: int) -> bytes:
    """Encode the device time of a frame."""
    return DeviceTimeRow(seq=seq, t_device_ns=t_device_ns).model_dump_json().encode()


def device_time_from_json(data: bytes | memoryview) -> tuple[int, int]:
    """Decode (seq, t_device_ns).

    Raises:
        ValueError: Not such a row.
    """
    row = DeviceTimeRow.model_validate_json(bytes(data))
    return row.seq, row.t_device_ns


def encoder_to_json(sample: EncoderSample, names: tuple[str, ...]) -> bytes:
    """Encode an encoder sample; angles that are not finite become null.

    Raises:
        ValueError: `names` and the angles differ in number.
    """
    angles = [float(angle) for angle in sample.angles_rad]
    if len(angles) != len(names):
        raise ValueError(f"{len(angles)} angles for {len(names)} joint names")
    row = EncoderRow(
        seq=sample.seq,
        t_device_ns=sample.t_device_ns,
        t_capture_ns=sample.t_capture_ns,
        names=names,
        angles_rad=tuple(angle if math.isfinite(angle) else None for angle in angles),
    )
    return row.model_dump_json().encode()


def encoder_from_json(data: bytes | memoryview, t_arrival_ns: int) -> tuple[EncoderSample, tuple[str, ...]]:
    """Decode an encoder sample and its joint names; null becomes NaN.

    Raises:
        ValueError: Not such a row, names repeated, or as many angles as names missing.
    """
    row = EncoderRow.model_validate_json(bytes(data))
    if len(row.angles_rad) != len(row.names):
        raise ValueError(f"{len(row.angles_rad)} angles for {len(row.names)} joint names")
    if len(set(row.names)) != len(row.names):
        raise ValueError("a joint name stands there twice")
    angles = np.array([math.nan if angle is None else angle for angle in row.angles_rad])
    return EncoderSample(row.seq, angles, row.t_device_ns, t_arrival_ns, row.t_capture_ns), row.names


def truth_to_json(truth: TruthSample) -> bytes:
    """Encode a truth sample."""
    row = TruthRow(
        t_ns=truth.t_ns,
        gh_from_arm=_rows3(truth.gh_from_arm),
        m0_from_arm=_rows4(truth.m0_from_arm),
        e_from_m0=_rows4(truth.e_from_m0),
        e_from_m1=_rows4(truth.e_from_m1),
        e_from_arm=_rows4(truth.e_from_arm),
        joints_rad=truth.joints_rad,
        elbow_rad=truth.elbow_rad,
    )
    return row.model_dump_json().encode()


def truth_from_json(data: bytes | memoryview) -> TruthSample:
    """Decode a truth sample.

    Raises:
        ValueError: Not such a row, or a matrix is not rigid.
    """
    row = TruthRow.model_validate_json(bytes(data))
    gh_from_arm = np.array(row.gh_from_arm)
    problem = rigidity_problem(transform(gh_from_arm, (0.0, 0.0, 0.0)))
    if problem:
        raise ValueError(f"gh_from_arm {problem}")
    return TruthSample(
        t_ns=row.t_ns,
        gh_from_arm=gh_from_arm,
        m0_from_arm=_rigid("m0_from_arm", row.m0_from_arm),
        e_from_m0=_rigid("e_from_m0", row.e_from_m0),
        e_from_m1=_rigid("e_from_m1", row.e_from_m1),
        e_from_arm=_rigid("e_from_arm", row.e_from_arm),
        joints_rad=row.joints_rad,
        elbow_rad=row.elbow_rad,
    )


def _rigid(key: str, rows: Matrix4) -> Array:
    T = np.array(rows)
    problem = rigidity_problem(T)
    if problem:
        raise ValueError(f"{key} {problem}")
    return T


def _rows3(R: Array) -> Matrix3:
    a, b, c = ((float(x), float(y), float(z)) for x, y, z in R)
    return a, b, c


def _rows4(T: Array) -> Matrix4:
    a, b, c, d = ((float(x), float(y), float(z), float(w)) for x, y, z, w in T)
    return a, b, c, d
