"""What a lens and a sensor do to an ideal picture: light, vignetting, noise, quantisation, missing depth."""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ghest_rt.geometry.so3 import Array
from ghest_rt.simulation.optics import Float32, Imaging
from ghest_rt.simulation.sensors import CameraProfile

_TILE_MARGIN_PX = 96
_EDGE_M = 0.008
_GRAZING_COSINE = 0.25
_DROPOUT_SIGMAS = 2.9  # one pixel in 270 measures nothing


@dataclass(frozen=True, slots=True)
class Light:
    """The light in the room.

    Attributes:
        brightness: Factor on all channels.
        white_balance: Factor on red, green and blue.
    """

    brightness: float = 1.0
    white_balance: tuple[float, float, float] = (1.0, 1.0, 1.0)


class ColorSensor:
    """Turns ideal colours into 8-bit values. Noise comes from a tile, shifted at random for each frame."""

    def __init__(self, profile: CameraProfile, light: Light, imaging: Imaging, rng: np.random.Generator) -> None:
        k = profile.color
        self._imaging = imaging
        self._gain = imaging.gain * light.brightness * np.array(light.white_balance)
        self._drift = profile.light_drift
        self._phase = rng.uniform(0.0, 2 * math.pi, 4)
        self._rate_hz = rng.uniform(0.05, 0.15, 4)
        v, u = np.mgrid[0 : k.height_px, 0 : k.width_px]
        r2 = ((u - k.cx_px) ** 2 + (v - k.cy_px) ** 2) / (k.cx_px**2 + k.cy_px**2)
        self._lens = (1.0 - profile.vignetting * r2).astype(np.float32)[..., None] if profile.vignetting else None
        self._noise = _tile(rng, k.height_px, k.width_px, 3, profile.color_noise)

    def expose(self, ideal: Float32, t_s: float, rng: np.random.Generator) -> NDArray[np.uint8]:
        """Return the (H, W, 3) uint8 image of ideal colours 0-255."""
        gain = self._gain.copy()
        if self._drift:
            wave = np.sin(2 * math.pi * self._rate_hz * t_s + self._phase)
            gain *= 1.0 + self._drift * (0.6 * wave[0] + 0.4 * wave[1:])
        light = gain.astype(np.float32) if self._lens is None else self._lens * gain.astype(np.float32)
        image = ideal * light
        if self._noise is not None:
            image += _cut(self._noise, ideal.shape[0], ideal.shape[1], rng)
        return np.asarray(cv2.convertScaleAbs(np.maximum(self._imaging.develop(image), 0.0)), dtype=np.uint8)


class DepthSensor:
    """Turns ideal depth into counts."""

    def __init__(self, profile: CameraProfile, rng: np.random.Generator) -> None:
        self._profile = profile
        self._noise = _tile(rng, profile.depth.height_px, profile.depth.width_px, 1, 1.0 if profile.depth_noise_m else 0.0)

    def measure(self, z_m: Array, facing: Array | None, rng: np.random.Generator) -> NDArray[np.uint16]:
        """Return the (H, W) uint16 counts of ideal depths; `facing` is the cosine between ray and surface normal."""
        p = self._profile
        low, high = p.range_m
        valid = (z_m >= low) & (z_m <= high)
        z = np.where(valid, z_m, 0.0)
        if p.depth_holes and facing is not None:
            kernel = np.ones((3, 3), np.uint8)
            flat = z.astype(np.float32)
            valid &= (cv2.dilate(flat, kernel) - cv2.erode(flat, kernel)) < _EDGE_M
            valid &= facing > _GRAZING_COSINE
        if self._noise is not None:
            noise = _cut(self._noise, z.shape[0], z.shape[1], rng)[..., 0]
            valid &= np.abs(noise) < _DROPOUT_SIGMAS
            z = z + p.depth_noise_m * noise
        counts = np.rint(z / p.depth_unit_m)
        return np.where(valid & (counts < 65536), counts, 0.0).astype(np.uint16)


def _tile(rng: np.random.Generator, height: int, width: int, channels: int, sigma: float) -> Float32 | None:
    if sigma == 0.0:
        return None
    shape = (height + _TILE_MARGIN_PX, width + _TILE_MARGIN_PX, channels)
    return np.float32(sigma) * rng.standard_normal(shape, dtype=np.float32)


def _cut(tile: Float32, height: int, width: int, rng: np.random.Generator) -> Float32:
    v, u = (int(n) for n in rng.integers(0, _TILE_MARGIN_PX + 1, 2))
    cut = tile[v : v + height, u : u + width]
    flip_v, flip_u = (bool(n) for n in rng.integers(0, 2, 2))
    return cut[:: -1 if flip_v else 1, :: -1 if flip_u else 1]
