"""What lens, sensor and print of a simulated session do worse than planned, and how it is written on the command line.

The estimator is not told, except of the distortion that a calibration would have found.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import Intrinsics
from ghest_rt.config.station import Marker
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import Array
from ghest_rt.simulation.disturbances import number
from ghest_rt.simulation.sensors import CameraProfile

_SUB_EXPOSURES = 12
_APERTURE_POINTS = 24
_GOLDEN_ANGLE_RAD = math.pi * (3.0 - math.sqrt(5.0))
_RAW_SCALE = 64.0  # raw values are kept in finer steps than 8 bits until colours are interpolated

Float32 = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class _Form:
    value: str
    limits: tuple[float, float]
    remedy: str


_FORMS: dict[str, _Form | None] = {
    "bayer": None,
    "defocus": _Form("PIXELS", (0.0, 3.0), "give the radius of the circle of confusion, 0 to 3 pixels"),
    "motion-blur": _Form("SECONDS", (0.0, 0.03), "give an exposure time from 0 to 0.03 seconds"),
    "distortion": _Form("K1", (-0.1, 0.1), "give a coefficient from -0.1 to 0.1"),
    "untold-distortion": _Form("K1", (-0.05, 0.05), "give a coefficient from -0.05 to 0.05"),
    "wrong-color": _Form("LEVELS", (0.0, 60.0), "give 0 to 60 levels of 255"),
    "gain": _Form("FACTOR", (0.1, 4.0), "give a factor from 0.1 to 4"),
    "gamma": _Form("EXPONENT", (0.3, 3.0), "give an exponent from 0.3 to 3"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Imaging:
    """What goes wrong with the colour images; by default nothing.

    Attributes:
        bayer: One colour per pixel (RGGB), the others interpolated from its neighbours.
        defocus_px: Radius of the circle of confusion.
        exposure_s: Exposure time; None for the sensor's own.
        distortion: Added to the radial coefficient k1 of the lens; the calibration knows it.
        untold_distortion: The same, but the calibration does not know it.
        wrong_color: How far every channel of every printed disk is from the station file's colour, of 255.
        gain: Factor on what the sensor collects, before noise; what exceeds 255 is cut off.
        gamma: Exponent of the tone scale: 255 (value / 255)^gamma.
        texts: As given on the command line.
    """

    bayer: bool = False
    defocus_px: float = 0.0
    exposure_s: float | None = None
    distortion: float = 0.0
    untold_distortion: float = 0.0
    wrong_color: float = 0.0
    gain: float = 1.0
    gamma: float = 1.0
    texts: tuple[str, ...] = ()

    def profile(self, planned: CameraProfile) -> CameraProfile:
        """Return the camera with its exposure time, and the lens as the calibration knows it."""
        profile = planned
        if self.exposure_s is not None:
            profile = replace(profile, exposure_s=self.exposure_s, sub_exposures=_SUB_EXPOSURES)
        if self.distortion:
            color = _bent(profile.color, self.distortion)
            profile = replace(profile, color=color, depth=color if profile.depth_is_registered else profile.depth)
        return profile

    def lens(self, told: Intrinsics) -> Intrinsics:
        """Return the lens as it is."""
        return _bent(told, self.untold_distortion) if self.untold_distortion else told

    def printed(self, marker: Marker, name: str, seed: int) -> Marker:
        """Return the marker as the printer made it: every channel off by `wrong_color`, up or down by chance."""
        if not self.wrong_color:
            return marker
        signs = np.random.default_rng((seed, 4, *name.encode())).choice((-1.0, 1.0), (4, 3))
        colors = np.clip(np.rint(np.array(marker.disk_rgb) + self.wrong_color * signs), 0, 255).astype(int)
        return marker.model_copy(update={"disk_rgb": tuple(map(tuple, colors.tolist()))})

    def develop(self, collected: Float32) -> Float32:
        """Return (H, W, 3) colours 0-255 from what the sensor collected, noise included."""
        image = collected
        if self.bayer:
            image = _interpolated(image)
        if self.gamma != 1.0:
            image = np.float32(255.0) * (np.clip(image, 0.0, 255.0) / np.float32(255.0)) ** np.float32(self.gamma)
        return image


def aperture_px(radius_px: float) -> Array:
    """Return (n, 2) points spread evenly over a circle of confusion; the middle alone for radius 0."""
    if not radius_px:
        return np.zeros((1, 2))
    k = np.arange(_APERTURE_POINTS)
    radius = radius_px * np.sqrt((k + 0.5) / _APERTURE_POINTS)
    points = radius[:, None] * np.column_stack((np.cos(k * _GOLDEN_ANGLE_RAD), np.sin(k * _GOLDEN_ANGLE_RAD)))
    return np.asarray(points - points.mean(axis=0))


def parse_imaging(texts: Iterable[str]) -> Imaging:
    """Return what `--image KIND[:VALUE]`, given once or more, asks for.

    Raises:
        BadInputError: One is not of a known form, or there are two of one kind; the text says which part.
    """
    given = tuple(texts)
    values: dict[str, float] = {}
    for text in given:
        option = f"--image {text}"
        kind, colon, value = text.partition(":")
        if kind not in _FORMS:
            raise BadInputError(f"{option}: {kind!r} is unknown: give one of {', '.join(map(_usage, _FORMS))}")
        if kind in values:
            raise BadInputError(f"{option}: there is another {kind} already: give one of a kind")
        form = _FORMS[kind]
        if bool(colon) != (form is not None):
            raise BadInputError(f"{option}: give it as {_usage(kind)}")
        values[kind] = 1.0 if form is None else number(option, form.value, value, form.limits, form.remedy)
    return Imaging(
        bayer="bayer" in values,
        defocus_px=values.get("defocus", 0.0),
        exposure_s=values.get("motion-blur"),
        distortion=values.get("distortion", 0.0),
        untold_distortion=values.get("untold-distortion", 0.0),
        wrong_color=values.get("wrong-color", 0.0),
        gain=values.get("gain", 1.0),
        gamma=values.get("gamma", 1.0),
        texts=given,
    )


def _usage(kind: str) -> str:
    form = _FORMS[kind]
    return kind if form is None else f"{kind}:{form.value}"


def _bent(lens: Intrinsics, k1: float) -> Intrinsics:
    first, *others = lens.distortion
    k2, p1, p2, k3 = others
    return replace(lens, distortion=(first + k1, k2, p1, p2, k3))


def _interpolated(image: Float32) -> Float32:
    """Keep one colour per pixel, RGGB, and interpolate the others bilinearly."""
    raw = np.empty(image.shape[:2], dtype=np.float32)
    for row in range(2):
        for column in range(2):
            raw[row::2, column::2] = image[row::2, column::2, row + column]
    counts = np.clip(np.rint(raw * np.float32(_RAW_SCALE)), 0, 255 * _RAW_SCALE).astype(np.uint16)
    # OpenCV names the pattern by the second row's second and third pixels: its "BG" is RGGB.
    colors = cv2.cvtColor(counts, cv2.COLOR_BayerBG2RGB)
    return np.asarray(colors, dtype=np.float32) / np.float32(_RAW_SCALE)
