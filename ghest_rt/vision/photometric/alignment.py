"""Gauss-Newton on the coverage of every pixel near the disks' edges, and on the depth plane.

Unknowns: the pose (rotation w, translation t, both in camera axes), the blur of the edges and an offset of all edges along
their normals, which takes up what makes every disk look larger or smaller (a curved tone scale, bleeding of print or pixels).
"""

import math
from dataclasses import replace

import cv2
import numpy as np

from ghest_rt.geometry.so3 import Array, exp_so3
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.photometric.edge_pixels import EdgePixelSampler
from ghest_rt.vision.photometric.edge_profile import PIXEL_VARIANCE, profile_of
from ghest_rt.vision.pose_fit import PoseFit, plane_terms
from ghest_rt.vision.sighting import Sighting
from ghest_rt.vision.small import inverse_of

_MAX_STEPS = 3
_SETTLED_PX = 0.15  # a step that moves no edge by more needs no other
_MAX_SHIFT_PX = 0.6
_FIRST_BLUR_PX = 0.08
_BLUR_RANGE_PX = (0.02, 1.1)
_BLUR_PRIOR_PX = 0.3
_OFFSET_PRIOR_PX = 0.05
_SIGMAS = 3.5
_LEAST_NOISE = 1.2  # of 255: rounding, and what the profile does not know
_MAX_NOISE = 30.0
_LEAST_PIXELS = 60
_FOLLOW = 0.3
_MAX_CONFLICT = 60.0  # squared deviations from the pose before, by its covariance, beyond which something else was aligned
_PLANE_EXPECTED = 3.0


class Alignment:
    """Improves poses from disk centres by the disks' edges. Remembers the blur."""

    def __init__(self, layout: MarkerLayout, optics: Optics) -> None:
        self._sampler = EdgePixelSampler(layout, optics)
        self._blur_px = _FIRST_BLUR_PX
        self._radius_m = layout.radius_m

    def reset(self) -> None:
        """Forget the blur."""
        self._blur_px = _FIRST_BLUR_PX

    def __call__(self, sighting: Sighting) -> PoseFit | None:
        """Return the aligned pose, or None if the edges do not make it better."""
        fit = sighting.fit
        R, p_m = fit.R, fit.p_m
        blur_px, offset_px = self._blur_px, 0.0
        pixels = self._sampler(sighting, R, p_m, blur_px)
        if pixels is None:
            return None
        plane_information = np.zeros((3, 3)) if sighting.plane is None else inverse_of(sighting.plane.covariance)
        if plane_information is None:
            return None
        for _ in range(_MAX_STEPS):
            edges = pixels.edges(R, p_m)
            if edges is None:
                return None
            profile = profile_of(blur_px)
            bend = 0.5 * (PIXEL_VARIANCE + profile.blur_px * profile.blur_px)
            table = profile(edges.distance_px + bend * edges.curvature - offset_px, edges.sine2)
            J = np.empty((8, len(edges.distance_px)))
            np.multiply(edges.jacobian, table[1], out=J[:6])
            np.negative(table[1], out=J[6])
            J[7] = table[2]
            J *= pixels.contrast
            residual = (pixels.alpha - table[0] - (blur_px - profile.blur_px) * table[2]) * pixels.contrast
            noise2 = _noise2(residual)
            if noise2 > _MAX_NOISE**2:
                return None
            used = np.abs(residual) < _SIGMAS * math.sqrt(noise2)
            residual *= used
            J *= used
            count = int(np.count_nonzero(used))
            if count < _LEAST_PIXELS:
                return None
            # Edges are noisier than areas: the noise that counts is that of the pixels that inform.
            slope2 = J[6] * J[6]
            noise2 = max(float(slope2 @ (residual * residual)) / float(slope2.sum()) * count / (count - 8), _LEAST_NOISE**2)
            information = (J @ J.T) / noise2
            gradient = (J @ residual) / noise2
            information[6, 6] += _OFFSET_PRIOR_PX**-2
            gradient[6] -= offset_px * _OFFSET_PRIOR_PX**-2
            information[7, 7] += _BLUR_PRIOR_PX**-2
            gradient[7] += (self._blur_px - blur_px) * _BLUR_PRIOR_PX**-2
            if sighting.plane is not None:
                off, J_plane = plane_terms(R, p_m, sighting.plane)
                weighted = plane_information @ J_plane
                information[:6, :6] += J_plane.T @ weighted
                gradient[:6] += off @ weighted
            solved, column = cv2.solve(information, gradient, flags=cv2.DECOMP_CHOLESKY)
            if not solved:
                return None
            change = np.asarray(column, dtype=np.float64).ravel()
            moved_px = float(np.abs(change[:6] @ edges.jacobian).max())
            if not moved_px < _MAX_SHIFT_PX:
                return None
            R = exp_so3(change[:3]) @ R
            p_m = p_m + change[3:6]
            offset_px += float(change[6])
            blur_px = min(max(blur_px + float(change[7]), _BLUR_RANGE_PX[0]), _BLUR_RANGE_PX[1])
            if moved_px < _SETTLED_PX:
                break
        return self._judged(sighting, R, p_m, blur_px, information)

    def _judged(self, sighting: Sighting, R: Array, p_m: Array, blur_px: float, information: Array) -> PoseFit | None:
        """Return the fit with the nuisances taken out of its information; None if it contradicts the pose it came from."""
        fit = sighting.fit
        nuisances = inverse_of(information[6:, 6:].copy())
        if nuisances is None:
            return None
        cross = information[:6, 6:]
        pose_information = information[:6, :6] - cross @ nuisances @ cross.T
        turn = R @ fit.R.T
        w = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        away = np.concatenate([w, p_m - fit.p_m])
        if float(away @ fit.information @ away) > _MAX_CONFLICT:
            return None
        self._blur_px += _FOLLOW * (blur_px - self._blur_px)
        return replace(fit, R=R, p_m=p_m, information=pose_information)


def _noise2(residual: Array) -> float:
    """Return a robust estimate of the residuals' variance."""
    sizes = np.abs(residual)
    middle = float(np.partition(sizes, len(sizes) // 2)[len(sizes) // 2])
    return max((1.4826 * middle) ** 2, _LEAST_NOISE**2)
