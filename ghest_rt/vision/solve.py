"""From measured disks and the depth plane to one pose, or the reason why there is none."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ghest_rt.messages.results import MarkerStatus
from ghest_rt.vision.disk_centers import DiskCenters
from ghest_rt.vision.ellipses import MarkerImage
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.planar_pose import Pose, mirrored
from ghest_rt.vision.plate_plane import Plane
from ghest_rt.vision.pose_fit import Centers, PoseFit, fit_pose

_TRACKED_STEPS = 4
_COLD_STEPS = 8
_SIGMA_FLOOR_PX = 0.004  # pixel aliasing of an anti-aliased disk of a few pixels' radius
_SIGMA_FACTOR = 1.3  # edges are noisier than interiors: colour and brightness model errors add there
_MAX_DEVIATION_PX = 0.35
_MAX_DEVIATION_SIGMAS = 5.0
_MAX_PLANE_OFF = 0.03  # change of theta, relative, that the fit may ask of the plane: a scale error of depth, not another plane
_TIGHT = 8.0  # squared deviations per degree of freedom above which something may be wrong
_EXPECTED = 3.0  # squared deviations per degree of freedom that noise explains
_CLEARLY = 6.0  # how much better a fit must be for a disk to be left out
_LEAST_DROP_PX = 0.1  # and how far off a centre must be
_FORETOLD_PX = 0.08  # a prediction is good if every disk is so near to where it puts it
_FORETOLD_PLANE_OFF = 0.01  # and theta, relative
_SAME_POSE_RAD = 0.06
_TELL_APART_CHI2 = 16.0
_RANGE_M = (0.03, 2.0)


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """What became of one attempt.

    Attributes:
        status: OK or COLOR_ONLY with a fit, else the reason.
        fit: The pose, if there is one.
        disks: How many disks took part.
    """

    status: MarkerStatus
    fit: PoseFit | None = None
    disks: int = 0


class Solver:
    """Fuses the disks' centres with the plane and checks what comes out."""

    def __init__(self, layout: MarkerLayout, optics: Optics) -> None:
        self._layout = layout
        self._optics = optics

    def centers(self, measured: DiskCenters) -> Centers:
        """Return the good disks' centres as rays."""
        seen = [(k, disk) for k, disk in enumerate(measured) if disk is not None]
        places = np.array([(disk.u, disk.v) for _, disk in seen]).reshape(-1, 2)
        rays = self._optics.disk_rays(places, np.array([[disk.radius2_px] for _, disk in seen]).reshape(-1, 1))
        sigma = [math.hypot(_SIGMA_FLOOR_PX, _SIGMA_FACTOR * disk.sigma_px) / self._optics.mean_focal_px for _, disk in seen]
        plate_m = self._layout.centers_m
        if len(seen) < len(plate_m):
            plate_m = plate_m[[k for k, _ in seen]]
        return Centers(plate_m, rays, np.array(sigma), self._layout.radius_m)

    def foretold(self, measured: DiskCenters, predicted: MarkerImage, plane: Plane | None, start: Pose) -> bool:
        """Whether all four disks and the plane are where a prediction puts them, so that nothing contradicts it."""
        R, p_m = start
        depth_m = float(p_m[2])
        if plane is None or not _RANGE_M[0] <= depth_m <= _RANGE_M[1]:
            return False
        for seen, disk in zip(measured, predicted.disks, strict=True):
            if seen is None or abs(seen.u - disk.u) > _FORETOLD_PX or abs(seen.v - disk.v) > _FORETOLD_PX:
                return False
        theta = R[:, 2] / (R[:, 2] @ p_m)
        off = plane.theta - theta
        return float(off @ off) < _FORETOLD_PLANE_OFF**2 * float(theta @ theta) and float(theta[2]) > 0.0

    def track(self, centers: Centers, plane: Plane | None, start: Pose) -> Solution:
        """Solve from a pose predicted by earlier frames."""
        disks = len(centers.sigma)
        if disks < 2 or (disks == 2 and plane is None):
            return Solution(MarkerStatus.TOO_FEW_DISKS, disks=disks)
        if plane is None:
            return self._color_tracked(centers, start)
        fit = fit_pose(*start, centers, plane, _TRACKED_STEPS)
        return self._with_plane(centers, plane, fit, lambda c: self._color_tracked(c, start))

    def cold(self, centers: Centers, plane: Plane | None, starts: tuple[Pose, Pose]) -> Solution:
        """Solve from the two poses of a homography."""
        disks = len(centers.sigma)
        if disks < 2 or (disks < 4 and plane is None):
            return Solution(MarkerStatus.TOO_FEW_DISKS, disks=disks)
        if plane is None:
            return self._color_cold(centers, starts)
        normal = plane.theta / np.linalg.norm(plane.theta)
        # The plane's normal points away from the camera, the marker's z axis towards it.
        start = min(starts, key=lambda pose: float(pose[0][:, 2] @ normal))
        fit = fit_pose(*start, centers, plane, _COLD_STEPS)
        return self._with_plane(centers, plane, fit, lambda c: self._color_cold(c, starts))

    def _with_plane(
        self, centers: Centers, plane: Plane, fit: PoseFit | None, color_only: Callable[[Centers], Solution]
    ) -> Solution:
        """Judge a fit with depth; leave out the disk or the plane that contradicts the rest."""
        disks = used = len(centers.sigma)
        far = fit is not None and float(fit.deviations.max()) > _LEAST_DROP_PX / self._optics.mean_focal_px
        if fit is not None and far and disks == 4 and fit.chi2 > _TIGHT * _freedom(disks):
            dropped = self._without_one(centers, plane, fit)
            if dropped is not None and dropped.chi2 / _freedom(3) < fit.chi2 / _freedom(4) / _CLEARLY:
                fit, used = dropped, 3
        if fit is not None and fit.plane_off < _MAX_PLANE_OFF and self._plausible(fit):
            return self._checked(_widened(fit, used), MarkerStatus.OK, used)
        return color_only(centers) if disks == 4 else Solution(MarkerStatus.BAD_FIT, disks=disks)

    def _without_one(self, centers: Centers, plane: Plane, fit: PoseFit) -> PoseFit | None:
        """Return the best fit of three of four disks: one may be covered by something of the plate's colour."""
        fits = []
        for dropped in range(4):
            keep = np.arange(4) != dropped
            three = Centers(centers.plate_m[keep], centers.rays[keep], centers.sigma[keep], centers.radius_m)
            fits.append(fit_pose(fit.R, fit.p_m, three, plane, _COLD_STEPS))
        return min((found for found in fits if found is not None), key=lambda found: found.chi2, default=None)

    def _color_tracked(self, centers: Centers, start: Pose) -> Solution:
        """Solve without depth from a prediction; the mirrored pose takes over only if it is plainly better."""
        disks = len(centers.sigma)
        if disks < 3:
            return Solution(MarkerStatus.TOO_FEW_DISKS, disks=disks)
        fit = fit_pose(*start, centers, None, _COLD_STEPS)
        if disks == 4:
            R, p_m = start
            other = fit_pose(mirrored(R, p_m), p_m, centers, None, _COLD_STEPS)
            if other is not None and (fit is None or other.center_chi2 + _TELL_APART_CHI2 < fit.center_chi2):
                fit = other
        if fit is None or not self._plausible(fit):
            return Solution(MarkerStatus.BAD_FIT, disks=disks)
        return self._checked(fit, MarkerStatus.COLOR_ONLY, disks)

    def _color_cold(self, centers: Centers, starts: tuple[Pose, Pose]) -> Solution:
        """Solve without depth or memory: one of the two poses must explain the image plainly better."""
        disks = len(centers.sigma)
        fits = [fit_pose(*start, centers, None, _COLD_STEPS) for start in starts]
        sound = sorted((fit for fit in fits if fit is not None and fit.R[2, 2] < 0.0), key=lambda fit: fit.center_chi2)
        if not sound or not self._plausible(sound[0]):
            return Solution(MarkerStatus.BAD_FIT, disks=disks)
        if len(sound) == 2:
            apart = float(np.linalg.norm(sound[0].R - sound[1].R)) / 2**0.5
            if apart > _SAME_POSE_RAD and sound[1].center_chi2 - sound[0].center_chi2 < _TELL_APART_CHI2:
                return Solution(MarkerStatus.AMBIGUOUS, disks=disks)
        return self._checked(sound[0], MarkerStatus.COLOR_ONLY, disks)

    def _plausible(self, fit: PoseFit) -> bool:
        limit = _MAX_DEVIATION_PX / self._optics.mean_focal_px
        beyond = fit.deviations - _MAX_DEVIATION_SIGMAS * fit.sigma
        return float(beyond.max()) < limit and fit.faces_camera

    def _checked(self, fit: PoseFit, status: MarkerStatus, disks: int) -> Solution:
        if not _RANGE_M[0] <= float(fit.p_m[2]) <= _RANGE_M[1]:
            return Solution(MarkerStatus.OUT_OF_RANGE, disks=disks)
        return Solution(status, fit, disks)


def _freedom(disks: int) -> int:
    """Degrees of freedom of a fit of so many disks and a plane."""
    return 2 * disks + 3 - 6


def _widened(fit: PoseFit, disks: int) -> PoseFit:
    """Return the fit with a covariance that admits the misfit found: colour and depth seldom agree to their noise."""
    excess = fit.chi2 / (_EXPECTED * max(_freedom(disks), 1))
    return fit if excess <= 1.0 else replace(fit, information=fit.information / excess)
