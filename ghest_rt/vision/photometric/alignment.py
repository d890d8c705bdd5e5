"""Gauss-Newton on the coverage of every pixel near the disks' edges, and on the depth plane.

Unknowns: the pose (rotation w, translation t, both in the plate's axes) and the blur of the edges; for each disk an offset of
its edge along the normal, which takes up what makes it look larger or smaller (a curved tone scale, bleeding of print or
pixels), and a small shift of the whole disk (print, lens: what no number of pixels averages out).
"""

import math

import cv2
import numpy as np

from ghest_rt.geometry.so3 import Array, exp_so3
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.photometric.edge_pixels import EdgePixels, EdgePixelSampler, Edges
from ghest_rt.vision.photometric.edge_profile import PIXEL_VARIANCE, profile_of
from ghest_rt.vision.pose_fit import PoseFit, plane_terms
from ghest_rt.vision.sighting import Sighting
from ghest_rt.vision.small import inverse_of

_MAX_STEPS = 6
_SETTLED_PX = 0.15  # a step that moves no edge by more needs no other
_SETTLED_BLUR_PX = 0.1  # nor a change of blur that is less
_FIRST_BLURS_PX = (0.08, 0.5, 1.0)
_BLUR_RANGE_PX = (0.02, 1.1)
_BLUR_PRIOR_PX = 0.3
_OFFSET_PRIOR_PX = 0.05
_LEAST_UNEVEN_PX = 0.004  # shift of a disk that is always possible
_MOST_UNEVEN_PX = 0.2
_UNEVEN_FREEDOM = 5.0  # what eight shifts and a plane say beyond the pose
_DOUBTFUL = 2.0  # by which factor squared shifts must be larger than thought for another step
_SIGMAS = 3.5
_GATE = 16.0  # of 255: no pixel is an outlier for being this near
_LEAST_NOISE = 1.2  # of 255: rounding, and what the profile does not know
_MAX_NOISE = 30.0
_LEAST_PIXELS = 60
_FOLLOW = 0.3
_MAX_CONFLICT = 300.0  # squared deviations from the pose before, by its covariance, beyond which something else was aligned
_FIT, _BENDS = 8, 3  # rows of a block: pose, blur and the residual; offset and shift of a disk
_SIDE = _FIT + _BENDS
_CORNER = slice(_FIT * (_SIDE + 1), None, _SIDE + 1)  # of a flat block: the diagonal of the bends
_TURNS = np.array([1.0, -1.0, 1.0])  # signs of the axes that the plate is turned about, see `Edges`
_NO_PLANE = np.zeros((3, 3))


class Alignment:
    """Improves poses from disk centres by the disks' edges. Remembers the blur, and how unevenly the disks are placed."""

    def __init__(self, layout: MarkerLayout, optics: Optics) -> None:
        self._sampler = EdgePixelSampler(layout, optics)
        self.reset()

    def reset(self) -> None:
        """Forget what earlier frames taught."""
        self._sampler.reset()
        self._blur_px: float | None = None
        self._uneven_px = _LEAST_UNEVEN_PX

    def __call__(self, sighting: Sighting) -> PoseFit | None:
        """Return the aligned pose, or None if the edges do not make it better."""
        fit, plane = sighting.fit, sighting.plane
        R, p_m = fit.R, fit.p_m
        pixels = self._sampler(sighting, _FIRST_BLURS_PX[1] if self._blur_px is None else self._blur_px)
        plane_information = _NO_PLANE if plane is None else inverse_of(plane.covariance)
        edges = None if pixels is None else pixels.edges(R, p_m)
        if pixels is None or edges is None or plane_information is None:
            return None
        expected_px = blur_px = _likely_blur(pixels, edges) if self._blur_px is None else self._blur_px
        uneven_px = self._uneven_px
        bends = np.zeros((len(pixels.spans), _BENDS))
        axes = np.zeros((6, 6))
        for step in range(_MAX_STEPS):
            if step:
                edges = pixels.edges(R, p_m)
                if edges is None:
                    return None
            blocks = _blocks(pixels, edges, blur_px, bends if step else None)
            if blocks is None:
                return None
            certainty = np.array([_OFFSET_PRIOR_PX**-2, uneven_px**-2, uneven_px**-2])
            blocks.reshape(len(blocks), -1)[:, _CORNER] += certainty
            if step:
                blocks[:, _FIT:, _FIT - 1] -= bends * certainty
            inverses = [_inverse(block) for block in blocks[:, _FIT:, _FIT:].tolist()]
            answers = np.array(inverses) @ blocks[:, _FIT:, :_FIT]
            reduced = np.add.reduce(blocks[:, :_FIT, :_FIT] - blocks[:, :_FIT, _FIT:] @ answers, axis=0)
            information, gradient = reduced[:7, :7].copy(), reduced[:7, 7].copy()
            information[6, 6] += _BLUR_PRIOR_PX**-2
            gradient[6] += (expected_px - blur_px) * _BLUR_PRIOR_PX**-2
            np.multiply(R, _TURNS, out=axes[:3, :3])
            axes[3:, 3:] = R
            if plane is not None:
                off, J_plane = plane_terms(R, p_m, plane)
                J_plane = J_plane @ axes
                weighted = plane_information @ J_plane
                information[:6, :6] += J_plane.T @ weighted
                gradient[:6] += off @ weighted
            solved, column = cv2.solve(information, gradient, flags=cv2.DECOMP_CHOLESKY)
            if not solved:
                return None
            change = np.asarray(column, dtype=np.float64).ravel()
            moved_px = float(np.abs(change[:6] @ edges.jacobian).max())
            if not moved_px < sighting.reach_px:
                return None
            motion = axes @ change[:6]
            p_m = p_m + motion[3:]
            R = exp_so3(motion[:3]) @ R
            bends += answers[:, :, 7] - answers[:, :, :7] @ change
            before_px, blur_px = blur_px, min(max(blur_px + float(change[6]), _BLUR_RANGE_PX[0]), _BLUR_RANGE_PX[1])
            shifts = bends[:, 1:].ravel()
            shift2 = float(shifts @ shifts) / _UNEVEN_FREEDOM
            shift2 += sum(right[1] + down[2] for _, right, down in inverses) / len(shifts)  # the shifts' variances
            settled = moved_px < _SETTLED_PX and abs(blur_px - before_px) < _SETTLED_BLUR_PX
            if settled and shift2 < _DOUBTFUL * uneven_px**2:
                break
            uneven_px = min(max(math.sqrt(shift2), uneven_px), _MOST_UNEVEN_PX)
        # The blur is taken out of the information; the bends are already.
        cross = information[:6, 6:]
        pose_information = axes @ (information[:6, :6] - cross * (cross.T / information[6, 6])) @ axes.T
        if not self._agrees(fit, R, p_m):
            return None
        self._blur_px = blur_px if self._blur_px is None else self._blur_px + _FOLLOW * (blur_px - self._blur_px)
        uneven_px = max(math.sqrt(shift2), _LEAST_UNEVEN_PX)
        self._uneven_px += _FOLLOW * (uneven_px - self._uneven_px)
        return fit.moved(R, p_m, pose_information)

    @staticmethod
    def _agrees(fit: PoseFit, R: Array, p_m: Array) -> bool:
        """Whether a pose does not contradict the one that it began from."""
        (_, xy, xz), (yx, _, yz), (zx, zy, _) = (R @ fit.R.T).tolist()
        away = np.array([0.5 * (zy - yz), 0.5 * (xz - zx), 0.5 * (yx - xy), *(p_m - fit.p_m).tolist()])
        return float(away @ fit.information @ away) < _MAX_CONFLICT


def _blocks(pixels: EdgePixels, edges: Edges, blur_px: float, bends: Array | None) -> Array | None:
    """Return what the pixels of each disk say, or None if they do not show its edge.

    Args:
        pixels: The pixels.
        edges: Where they are.
        blur_px: Blur of the edges.
        bends: (disks, 3) offset of each disk's edge along its normal, and shift of the disk to the right and down, pixels;
            None if there are none.

    Returns:
        (disks, 11, 11): products, over the noise's variance, of the derivatives by pose (6) and blur (1), the residual (1), and
        the derivatives by the bends (3).
    """
    profile = profile_of(blur_px)
    distance_px = edges.curvature * (0.5 * (PIXEL_VARIANCE + profile.blur_px * profile.blur_px))
    distance_px += edges.distance_px
    if bends is not None:
        for span, (offset, right, down) in zip(pixels.spans, bends.tolist(), strict=True):
            distance_px[span] -= offset + right * edges.normal[0, span] + down * edges.normal[1, span]
    covered, slope, widening = profile(distance_px, edges.half_sine2)
    J = np.empty((_SIDE, len(slope)))
    residual, sizes = J[7], distance_px
    np.multiply(widening, blur_px - profile.blur_px, out=residual)
    covered += residual
    covered *= pixels.contrast
    np.subtract(pixels.excess, covered, out=residual)
    np.abs(residual, out=sizes)
    weight, count = pixels.contrast, len(sizes)
    if float(sizes.max()) >= _GATE:
        noise2 = _noise2(sizes)
        used = sizes < max(_SIGMAS * math.sqrt(noise2), _GATE)
        if noise2 > _MAX_NOISE**2:
            return None
        count = int(np.count_nonzero(used))
        residual *= used
        weight = weight * used
    if count < _LEAST_PIXELS:
        return None
    slope *= weight
    np.multiply(edges.jacobian, slope, out=J[:6])
    np.multiply(widening, weight, out=J[6])
    np.negative(slope, out=J[8])
    np.multiply(edges.normal, J[8], out=J[9:])
    # Edges are noisier than areas: the noise that counts is that of the pixels that inform.
    np.multiply(slope, residual, out=covered)
    noise2 = float(covered @ covered) / float(slope @ slope) * count / (count - _SIDE)
    blocks = np.empty((len(pixels.spans), _SIDE, _SIDE))
    for block, span in zip(blocks, pixels.spans, strict=True):
        part = J[:, span]
        np.matmul(part, part.T, out=block)
    blocks *= 1.0 / max(noise2, _LEAST_NOISE**2)
    return blocks


def _likely_blur(pixels: EdgePixels, edges: Edges) -> float:
    """Return the blur with which the pixels are explained best, of a few."""

    def misfit(blur_px: float) -> float:
        covered = profile_of(blur_px)(edges.distance_px, edges.half_sine2)[0]
        return float(np.abs(pixels.excess - pixels.contrast * covered).sum())

    return min(_FIRST_BLURS_PX, key=misfit)


def _inverse(block: list[list[float]]) -> list[list[float]]:
    """Return the inverse of a symmetric positive definite (3, 3) matrix by its cofactors."""
    (a, b, c), (_, d, e), (_, _, f) = block
    aa, ab, ac = d * f - e * e, c * e - b * f, b * e - c * d
    scale = 1.0 / (a * aa + b * ab + c * ac)
    aa, ab, ac = aa * scale, ab * scale, ac * scale
    bb, bc, cc = (a * f - c * c) * scale, (b * c - a * e) * scale, (a * d - b * b) * scale
    return [[aa, ab, ac], [ab, bb, bc], [ac, bc, cc]]


def _noise2(sizes: Array) -> float:
    """Return a robust estimate of the variance of residuals of these sizes."""
    middle = float(np.partition(sizes, len(sizes) // 2)[len(sizes) // 2])
    return max((1.4826 * middle) ** 2, _LEAST_NOISE**2)
