"""A cheap stand-in for the pipeline: no images, the same equations (6) to (10).

The markers' true poses in their cameras, at a few instants of a movement, take the place of what the detectors would find; what
is perturbed, and the estimator's geometry, are those of the rendered analysis. Left out: the detectors' own errors (10 µm and
0.007° for method `refined`) and the time between samples. So it stands for `refined`, not for `paper`, nor for `fused`, which
notices markers that have moved.
"""

import math
from collections.abc import Mapping

import numpy as np

from ghest_rt.estimation.arm_chain import CAMERAS, ArmChain
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import Array, exp_so3
from ghest_rt.kinematics.paper_chain import eq7_e_from_marker
from ghest_rt.messages.results import TruthSample
from ghest_rt.studies.metrics import ErrorAccumulator
from ghest_rt.studies.observing.observed import Observed
from ghest_rt.studies.sensitivity.parameters import AXES, Group, Parameter
from ghest_rt.sync.pose_track import PoseSample


class Surrogate:
    """One movement at a few instants.

    Args:
        session: The undisturbed session; its markers are not used.
        instants: How many instants, evenly spaced.
    """

    def __init__(self, session: Observed, instants: int) -> None:
        station = session.station
        self._chain = ArmChain(station.config, station.urdf_text, station.source, session.joints)
        self._joints = session.joints
        picked = np.linspace(0, len(session.truth) - 1, instants).round().astype(int)
        self._truth = [session.truth[k] for k in picked]
        self._angles = [np.array([truth.joints_rad[joint] for joint in self._joints]) for truth in self._truth]
        self._camera_from_e = [
            {camera: inverse(self._chain.e_from_camera(camera, angles)) for camera in CAMERAS} for angles in self._angles
        ]
        # Axes along which a marker is displaced, seen from the marker: the GH frame's and the elbow frame's (Table 3).
        self._axes = {"m0": self._chain.m0_from_gh[:3, :3], "m1": self._chain.m1_from_elw[:3, :3]}

    def errors(self, amounts: Mapping[Parameter, float]) -> tuple[float, float]:
        """Return the RMS errors of the arm's position (m) and orientation (deg) under perturbations all at once.

        Args:
            amounts: How much (m or deg) of each parameter of the groups shift, turn, mount_shift, mount_turn and encoder.
        """
        nominal_from_marker = {marker: self._moved(marker, amounts) for marker in ("m0", "m1")}
        mount = {camera: _mount_error(camera, amounts) for camera in CAMERAS}
        bias = np.array([math.radians(amounts.get(Parameter("encoder", joint, ""), 0.0)) for joint in self._joints])
        accumulator = ErrorAccumulator()
        for truth, angles, camera_from_e in zip(self._truth, self._angles, self._camera_from_e, strict=True):
            poses = []
            for camera, e_from_nominal in (("r0", truth.e_from_m0), ("r1", truth.e_from_m1)):
                marker = "m0" if camera == "r0" else "m1"
                seen = camera_from_e[camera] @ e_from_nominal @ nominal_from_marker[marker]
                believed = self._chain.e_from_camera(camera, angles + bias) @ mount[camera]
                poses.append(_sample(truth, eq7_e_from_marker(believed, seen)))
            accumulator.add(self._chain.estimate(truth.t_ns, poses[0], poses[1], {}, None), truth)
        rms = accumulator.rms()
        return rms.position_m, math.degrees(rms.orientation_rad)

    def _moved(self, marker: str, amounts: Mapping[Parameter, float]) -> Array:
        """Return nominal_from_marker: turns one after the other in the order of the axes, as the scene has them."""
        turns = np.diag(_vector(marker, "turn", amounts))
        turn = exp_so3(turns[0]) @ exp_so3(turns[1]) @ exp_so3(turns[2])
        return transform(turn, self._axes[marker] @ _vector(marker, "shift", amounts))


def _mount_error(camera: str, amounts: Mapping[Parameter, float]) -> Array:
    """Return what a calibrated mount is wrong by: one rotation vector, as `MountError` has it."""
    return transform(exp_so3(_vector(camera, "mount_turn", amounts)), _vector(camera, "mount_shift", amounts))


def _vector(what: str, group: Group, amounts: Mapping[Parameter, float]) -> Array:
    """Return the amounts along or about the three axes, metres or radians."""
    several = [Parameter(group, what, axis) for axis in AXES]
    values = np.array([amounts.get(parameter, 0.0) for parameter in several])
    return np.radians(values) if several[0].unit == "deg" else values


def _sample(truth: TruthSample, e_from_marker: Array) -> PoseSample:
    return PoseSample(
        t_ns=truth.t_ns,
        e_from_marker=e_from_marker,
        covariance=None,
        color_only=False,
        fewer_disks=False,
        bridged=False,
        newest_ns=truth.t_ns,
        encoders_ns=truth.t_ns,
    )
