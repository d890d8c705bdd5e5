"""From a serialised foxglove.RawImage to arrays, without copying the pixels where that is possible.

The protobuf library copies the image twice on the way; RawImage has seven flat fields, so they are read here directly from
the wire format (https://protobuf.dev/programming-guides/encoding/). Field numbers as in docs/recording-format.md.
"""

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import Intrinsics
from ghest_rt.recording.problems import Skip

_FIXED32 = struct.Struct("<I")
_WIDTH, _HEIGHT, _ENCODING, _STEP, _DATA = 2, 3, 4, 5, 6
_COLOR_ENCODINGS = ("rgb8", "bgr8", "8UC3")  # 8UC3 is another name of bgr8 in the schema
_DEPTH_BYTES = {"16UC1": 2, "mono16": 2, "32FC1": 4}


class UnusableImageError(Exception):
    """An image that is skipped; `skip` is why."""

    def __init__(self, skip: Skip, detail: str) -> None:
        super().__init__(detail)
        self.skip = skip


@dataclass(frozen=True, slots=True)
class RawImageFields:
    """The fields of a RawImage that matter here; `data` is a view."""

    width_px: int
    height_px: int
    encoding: str
    step_bytes: int
    data: memoryview


def parse_raw_image(message: memoryview) -> RawImageFields:
    """Read the fields of a serialised foxglove.RawImage; unknown ones are passed over.

    Raises:
        UnusableImageError: Not such a message.
    """
    fixed = {_WIDTH: 0, _HEIGHT: 0, _STEP: 0}
    encoding = ""
    data = memoryview(b"")
    byte = 0
    try:
        while byte < len(message):
            key, byte = _varint(message, byte)
            number, wire_type = key >> 3, key & 7
            if wire_type == 0:
                _, byte = _varint(message, byte)
            elif wire_type == 1:
                byte += 8
            elif wire_type == 5:
                (value,) = _FIXED32.unpack_from(message, byte)
                byte += 4
                if number in fixed:
                    fixed[number] = value
            elif wire_type == 2:
                length, byte = _varint(message, byte)
                field = message[byte : byte + length]
                byte += length
                if number == _ENCODING:
                    encoding = str(field, "utf-8")
                elif number == _DATA:
                    data = field
            else:
                raise ValueError(f"wire type {wire_type}")
        if byte != len(message):
            raise ValueError("it ends within a field")
    except (ValueError, IndexError, struct.error) as error:
        raise UnusableImageError(Skip.DAMAGED_MESSAGE, f"not a foxglove.RawImage in protobuf ({error})") from error
    return RawImageFields(fixed[_WIDTH], fixed[_HEIGHT], encoding, fixed[_STEP], data)


def color_image(message: memoryview, camera: Intrinsics) -> NDArray[np.uint8]:
    """Return the (H, W, 3) R G B image of a serialised RawImage; a view for unpadded `rgb8`.

    Raises:
        UnusableImageError: Damaged, of another size than `camera`, or of an encoding other than rgb8 and bgr8.
    """
    image = parse_raw_image(message)
    if image.encoding not in _COLOR_ENCODINGS:
        raise UnusableImageError(Skip.WRONG_ENCODING, f"encoding {image.encoding!r}, expected rgb8 or bgr8")
    rows = _rows(image, camera, 3)
    pixels = rows.reshape(camera.height_px, camera.width_px, 3)
    return pixels if image.encoding == "rgb8" else np.ascontiguousarray(pixels[:, :, ::-1])


def depth_image(message: memoryview, camera: Intrinsics, depth_unit_m: float) -> NDArray[np.uint16]:
    """Return the (h, w) depth counts of a serialised RawImage, 0 where there is no measurement.

    `32FC1` is taken as metres; what is not finite, not positive or beyond 65535 counts becomes 0.

    Raises:
        UnusableImageError: Damaged, of another size than `camera`, or of an encoding other than 16UC1, mono16 and 32FC1.
    """
    image = parse_raw_image(message)
    pixel_bytes = _DEPTH_BYTES.get(image.encoding)
    if pixel_bytes is None:
        raise UnusableImageError(Skip.WRONG_ENCODING, f"encoding {image.encoding!r}, expected 16UC1 or 32FC1")
    rows = _rows(image, camera, pixel_bytes)
    if pixel_bytes == 2:
        counts = rows.view("<u2")
        return counts if counts.flags.aligned else counts.copy()
    with np.errstate(over="ignore", invalid="ignore"):
        exact = rows.view("<f4") / np.float32(depth_unit_m)
        measured = (exact > 0.0) & (exact < 65535.5)  # false for NaN
    return np.rint(np.where(measured, exact, 0.0)).astype(np.uint16)


def _rows(image: RawImageFields, camera: Intrinsics, pixel_bytes: int) -> NDArray[np.uint8]:
    """Return the (H, W * pixel_bytes) bytes of the image without the padding of its rows, contiguous."""
    width_px, height_px = camera.width_px, camera.height_px
    if (image.width_px, image.height_px) != (width_px, height_px):
        raise UnusableImageError(
            Skip.WRONG_SIZE, f"{image.width_px}x{image.height_px} px, its calibration says {width_px}x{height_px} px"
        )
    row_bytes = width_px * pixel_bytes
    if image.step_bytes < row_bytes or len(image.data) < image.step_bytes * height_px:
        raise UnusableImageError(
            Skip.DAMAGED_MESSAGE,
            f"{len(image.data)} bytes of pixels with a step of {image.step_bytes}, "
            f"{width_px}x{height_px} px of {image.encoding} need {row_bytes * height_px}",
        )
    used = image.data[: image.step_bytes * height_px]
    rows = np.frombuffer(used, np.uint8).reshape(height_px, image.step_bytes)
    return rows if image.step_bytes == row_bytes else np.ascontiguousarray(rows[:, :row_bytes])


def _varint(message: memoryview, byte: int) -> tuple[int, int]:
    """Return (value, next byte) of the base 128 varint at `byte`."""
    value = 0
    for shift in range(0, 70, 7):
        digit = message[byte]
        byte += 1
        value |= (digit & 0x7F) << shift
        if digit < 0x80:
            return value, byte
    raise ValueError("a varint of more than ten bytes")
