"""Method `refined`: sub-pixel disks and the depth plane fused into one pose with its covariance (docs/vision.md)."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ghest_drivers.samples import CameraInfo, RgbdFrame
from ghest_rt.config.station import Marker
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import MarkerObservation, MarkerStatus
from ghest_rt.vision.checks import check_frame
from ghest_rt.vision.color_blobs import BlobFinder
from ghest_rt.vision.constellation import Constellation, ConstellationFinder
from ghest_rt.vision.disk_centers import Color, DiskCenters, DiskMeter
from ghest_rt.vision.ellipses import MarkerImage, marker_image
from ghest_rt.vision.layout import MarkerLayout
from ghest_rt.vision.motion import MotionTrack
from ghest_rt.vision.optics import Optics
from ghest_rt.vision.planar_pose import Pose, homography, pose_on_plane, poses_of_homography
from ghest_rt.vision.plate_light import PlateLight, PlateSampler
from ghest_rt.vision.plate_plane import Plane, PlateDepth
from ghest_rt.vision.pose_fit import PoseFit
from ghest_rt.vision.sighting import Polish, Sighting
from ghest_rt.vision.small import inverse_of
from ghest_rt.vision.solve import Solution, Solver

_BAND_PX = 2.0
_COLD_BAND_PX = 3.5
_BAND_OF_MARGIN = 0.6  # share of the white margin around a disk that the band may take
_CENTERED_PX = 0.4  # a prediction this good needs no second look
_MAX_LOOKS = 3
_LEARN = 0.2
_TRACKED_GATES_M = (0.004,)
_COLD_GATES_M = (0.02, 0.006)
_PLANE_FLOOR = 5e-5  # of theta, relative: what no number of pixels averages out
_MOTION_DOUBT = 0.15  # share of the motion between colour and depth image that may be wrong
_SURE_SHARE = 0.85
_REACH_PX = 0.6  # by which a better pose may move the edges of the one found
_FORETOLD_REACH_PX = 0.3  # and those of the one foretold
_NEUTRAL = (1.0, 1.0, 1.0)
_IDENTITY = np.eye(3)


class RefinedDetector:
    """Finds and tracks one marker in one camera. Stateful: frames in the order of capture, one thread.

    Args:
        camera_name: For the observations.
        marker_name: For the observations.
        marker: Geometry and nominal colours.
        info: The camera's calibration.
        color_only: Leave depth aside.
        polish: What may improve the pose once it is found, from the optics and the layout.
    """

    def __init__(
        self,
        camera_name: str,
        marker_name: str,
        marker: Marker,
        info: CameraInfo,
        *,
        color_only: bool = False,
        polish: Callable[[MarkerLayout, Optics], Polish] | None = None,
    ) -> None:
        self._camera = camera_name
        self._marker = marker_name
        self._info = info
        self._layout = MarkerLayout.of(marker)
        self._centers_m: list[list[float]] = self._layout.centers_m.tolist()
        self._optics = Optics(info.color)
        self._sampler = PlateSampler(self._layout, self._optics)
        self._meter = DiskMeter(self._layout)
        self._depth = None if color_only else PlateDepth(self._layout, info)
        self._finder = BlobFinder(info.color.width_px, info.color.height_px)
        self._constellations = ConstellationFinder(self._layout, self._optics)
        self._solver = Solver(self._layout, self._optics)
        self._motion = MotionTrack()
        self._white: Color | None = None
        self._light: PlateLight | None = None
        self._predicted: MarkerImage | None = None
        self._depth_from_color = inverse(info.color_from_depth)
        self._same_place = bool(np.abs(info.color_from_depth - np.eye(4)).max() < 1e-12)
        margin_m = self._layout.half_plate_m - float(np.abs(self._layout.centers_m).max()) - self._layout.radius_m
        self._polish = None if polish is None else polish(self._layout, self._optics)
        self._margin = max(margin_m, 0.1 * self._layout.radius_m) / self._layout.radius_m

    def reset(self) -> None:
        """Forget pose, motion, light and colours."""
        self._motion.reset()
        self._meter.reset()
        self._white = None
        if self._polish is not None:
            self._polish.reset()

    def detect(self, frame: RgbdFrame) -> MarkerObservation:
        """Return the marker's pose in the colour camera frame with its covariance, or why there is none.

        Raises:
            BadInputError: The images are not those of the camera that the detector was made for.
        """
        check_frame(frame, self._info)
        predicted = self._motion.predict(frame.t_capture_ns)
        solution = Solution(MarkerStatus.NOT_FOUND)
        if predicted is not None:
            solution = self._track(frame, predicted)
        if solution.fit is None:
            tracked, solution = solution, self._search(frame)
            if solution.status is MarkerStatus.NOT_FOUND and tracked.disks > 0:
                solution = tracked
        return self._observation(frame, solution)

    def _observation(self, frame: RgbdFrame, solution: Solution) -> MarkerObservation:
        fit = solution.fit
        pose = covariance = None
        if fit is not None:
            pose = transform(fit.R, fit.p_m)
            covariance = inverse_of(fit.information)
            self._motion.update(frame.t_capture_ns, pose)
        return MarkerObservation(
            camera=self._camera,
            marker=self._marker,
            seq=frame.seq,
            t_capture_ns=frame.t_capture_ns,
            t_arrival_ns=frame.t_arrival_ns,
            status=solution.status,
            camera_from_marker=pose,
            covariance=covariance,
            disks_used=solution.disks,
            depth_used=solution.status is MarkerStatus.OK,
        )

    def _track(self, frame: RgbdFrame, predicted: Array) -> Solution:
        """Measure where the marker should be by now."""
        measured = self._look(frame.color_rgb, predicted[:3, [0, 1, 3]], _BAND_PX)
        if isinstance(measured, MarkerStatus):
            return Solution(measured)
        seen = sum(disk is not None for disk in measured)
        plane = self._plane(frame, predicted, _TRACKED_GATES_M) if seen >= 2 else None
        start = predicted[:3, :3], predicted[:3, 3]
        fit = self._foretold(frame, measured, plane, start)
        if fit is not None:
            self._learn(measured)
            return Solution(MarkerStatus.OK, fit, seen)
        solution = self._solver.track(self._solver.centers(measured), plane, start)
        if solution.fit is not None:
            self._learn(measured)
        return self._polished(frame, measured, plane, solution)

    def _search(self, frame: RgbdFrame) -> Solution:
        """Look for the marker everywhere, first under the light last seen or guessed, then under neutral light."""
        guess = self._white or self._finder.bright_white(frame.color_rgb)
        best = Solution(MarkerStatus.NOT_FOUND)
        for white in (guess, _NEUTRAL):
            blobs = self._finder.find(frame.color_rgb, white)
            constellation = None if blobs is None else self._constellations.find(blobs)
            if constellation is not None:
                self._meter.relative = constellation.relative
                solution = self._cold(frame, constellation)
                if solution.fit is not None:
                    return solution
                best = solution
            elif blobs is not None and best.status is MarkerStatus.NOT_FOUND:
                best = Solution(MarkerStatus.TOO_FEW_DISKS)
        self._white = None
        return best

    def _cold(self, frame: RgbdFrame, constellation: Constellation) -> Solution:
        """Solve from a rough homography of the plate."""
        if len(constellation.seen) == 2:
            return self._cold_pair(frame, constellation)
        measured = self._look(frame.color_rgb, constellation.H, _COLD_BAND_PX)
        if isinstance(measured, MarkerStatus):
            return Solution(measured)
        centers = self._solver.centers(measured)
        if len(centers.sigma) < 3:
            return Solution(MarkerStatus.TOO_FEW_DISKS, disks=len(centers.sigma))
        starts = poses_of_homography(homography(centers.plate_m, centers.rays))
        if starts is None:
            return Solution(MarkerStatus.BAD_FIT, disks=len(centers.sigma))
        plane = self._cold_plane(frame, starts)
        solution = self._solver.cold(centers, plane, starts)
        if solution.fit is not None and len(constellation.seen) == 3:
            # The homography was only affine: look again from the pose, also for the disk that was missing.
            solution = self._track(frame, transform(solution.fit.R, solution.fit.p_m))
        elif solution.fit is not None:
            self._learn(measured)
            H = np.column_stack([solution.fit.R[:, :2], solution.fit.p_m])
            self._predicted = marker_image(H, self._centers_m, self._layout.radius_m, self._optics)
            solution = self._polished(frame, measured, plane, solution)
        return solution

    def _polished(self, frame: RgbdFrame, measured: DiskCenters, plane: Plane | None, solution: Solution) -> Solution:
        """Return the solution with a better pose where there is one; a disk left out by the fit must not come in again."""
        seen = sum(disk is not None for disk in measured)
        if self._polish is None or solution.fit is None or solution.disks < seen:
            return solution
        if self._light is None or self._predicted is None:
            return solution
        used = plane if solution.status is MarkerStatus.OK else None
        fit = self._polish(Sighting(frame.color_rgb, self._predicted, measured, self._light, used, solution.fit, _REACH_PX))
        return solution if fit is None else Solution(solution.status, fit, solution.disks)

    def _foretold(self, frame: RgbdFrame, measured: DiskCenters, plane: Plane | None, start: Pose) -> PoseFit | None:
        """Return the pose made better straight from the prediction, or None if the disks' centres have to be solved first."""
        if self._polish is None or self._light is None or self._predicted is None:
            return None
        if not self._solver.foretold(measured, self._predicted, plane, start):
            return None
        guess = PoseFit.guess(*start)
        return self._polish(Sighting(frame.color_rgb, self._predicted, measured, self._light, plane, guess, _FORETOLD_REACH_PX))

    def _cold_pair(self, frame: RgbdFrame, constellation: Constellation) -> Solution:
        """Solve from two disks on the plane that depth shows around them."""
        starts = poses_of_homography(constellation.H)
        plane = None if starts is None else self._cold_plane(frame, starts)
        if plane is None:
            return Solution(MarkerStatus.TOO_FEW_DISKS, disks=2)
        pose = pose_on_plane(plane.theta, self._layout.centers_m[constellation.seen], constellation.rays)
        return Solution(MarkerStatus.BAD_FIT, disks=2) if pose is None else self._track(frame, pose)

    def _look(self, image: NDArray[np.uint8], H: Array, band_px: float) -> DiskCenters | MarkerStatus:
        """Measure the disks that a homography predicts, again where they turn out to be off."""
        predicted = marker_image(H, self._centers_m, self._layout.radius_m, self._optics)
        light = self._sampler(image, H)
        if predicted is None or light is None:
            return MarkerStatus.NOT_FOUND
        self._light, self._predicted = light, predicted
        places = [(disk.u, disk.v) for disk in predicted.disks]
        for look in range(_MAX_LOOKS):
            band = max(min(band_px, _BAND_OF_MARGIN * self._margin * predicted.minor_px), 1.0)
            measured = self._meter.measure(image, predicted, light, band, places)
            shifts = [(disk.u - u, disk.v - v) for disk, (u, v) in zip(measured, places, strict=True) if disk is not None]
            if not shifts or look + 1 == _MAX_LOOKS or max(max(abs(du), abs(dv)) for du, dv in shifts) < _CENTERED_PX:
                break
            mean_u, mean_v = (sum(shift[c] for shift in shifts) / len(shifts) for c in range(2))
            places = [
                (u + mean_u, v + mean_v) if disk is None else (disk.u, disk.v)
                for disk, (u, v) in zip(measured, places, strict=True)
            ]
            band_px = _BAND_PX
        return measured

    def _plane(self, frame: RgbdFrame, predicted: Array, gates_m: tuple[float, ...]) -> Plane | None:
        """Fit the plate's plane and bring it into the colour camera at the colour image's time."""
        if self._depth is None or frame.depth_counts is None:
            return None
        dt_s = (frame.t_depth_capture_ns - frame.t_capture_ns) * 1e-9
        then = self._motion.advance(predicted, dt_s) if dt_s else predicted
        plane = self._depth.fit(frame.depth_counts, self._depth_from_color @ then, gates_m)
        if plane is None:
            return None
        floor = _PLANE_FLOOR
        if dt_s or not self._same_place:
            moved = then @ inverse(predicted)
            floor += _MOTION_DOUBT * float(np.abs(then[:3, 3] - predicted[:3, 3]).max()) / float(predicted[2, 3])
            floor += _MOTION_DOUBT * float(np.abs(moved[:3, :3] - _IDENTITY).max())
            plane = plane.seen_from(self._depth_from_color @ moved)
        covariance = plane.covariance + _IDENTITY * (floor * floor * float(plane.theta @ plane.theta))
        return Plane(plane.theta, covariance, plane.share)

    def _cold_plane(self, frame: RgbdFrame, starts: tuple[Pose, Pose]) -> Plane | None:
        """Fit the plane from whichever of the two poses explains more of the depth image."""
        best: Plane | None = None
        for R, p_m in starts:
            plane = self._plane(frame, transform(R, p_m), _COLD_GATES_M)
            if plane is not None and (best is None or plane.share > best.share):
                best = plane
            if best is not None and best.share > _SURE_SHARE:
                break
        return best

    def _learn(self, measured: DiskCenters) -> None:
        """Let the remembered colours of disks and light follow what was seen."""
        self._meter.relative = [
            before if disk is None else _blend(before, disk.relative)
            for before, disk in zip(self._meter.relative, measured, strict=True)
        ]
        if self._light is not None:
            self._white = self._light.rgb


def _blend(before: Color, now: Color) -> Color:
    r, g, b = before
    return r + _LEARN * (now[0] - r), g + _LEARN * (now[1] - g), b + _LEARN * (now[2] - b)
