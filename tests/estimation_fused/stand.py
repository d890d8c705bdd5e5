"""A test stand of geometry alone: known movements, an exoskeleton that can take any pose, noise, latency, drift and outages."""

import math
from collections.abc import Callable, Container
from dataclasses import dataclass, field, replace

import numpy as np

from ghest_drivers.samples import EncoderSample
from ghest_rt.config.station import StationConfig
from ghest_rt.estimation.arm_chain import ArmChain
from ghest_rt.estimation.factory import make_estimator
from ghest_rt.estimation.fused.estimator import FusedEstimator
from ghest_rt.estimation.interface import GhEstimator
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import Array, exp_so3, log_so3, rot_x, rot_y, rot_z
from ghest_rt.messages.results import GhEstimate, MarkerObservation, MarkerStatus

MS = 1_000_000
START = 1_000 * MS
LENGTH_M = 0.3255
JOINTS = ("x", "y", "z", "yaw", "pitch", "roll")

# Three slides and three turns reach any pose of link l8.
_JOINT = (
    '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/><axis xyz="{4}"/><limit lower="-9" upper="9"/></joint>'
)
URDF = (
    '<robot name="free"><link name="l0"/><link name="a"/><link name="b"/><link name="c"/><link name="d"/><link name="e"/>'
    '<link name="l8"/>'
    + _JOINT.format("x", "prismatic", "l0", "a", "1 0 0")
    + _JOINT.format("y", "prismatic", "a", "b", "0 1 0")
    + _JOINT.format("z", "prismatic", "b", "c", "0 0 1")
    + _JOINT.format("yaw", "revolute", "c", "d", "0 1 0")
    + _JOINT.format("pitch", "revolute", "d", "e", "1 0 0")
    + _JOINT.format("roll", "revolute", "e", "l8", "0 0 1")
    + "</robot>"
)
LINK_FROM_CAMERA = {
    "r0": transform(rot_z(math.pi / 2) @ rot_x(math.pi), [0.1, -0.035, 0.12]),
    "r1": transform(rot_y(-math.pi / 2), [0.008, 0.364, 0.026]),
}
M0_FROM_GH = transform(np.eye(3), [-0.055, -0.010, -0.085])
M1_FROM_ELW = transform(np.eye(3), [0.0, -0.045, -0.055])
# The forearm, bent by about a right angle, is strapped to l8.
FOREARM: dict[str, object] = {"link": "l8", "axis": (0.0, 1.0, 0.0)}
# Encoders of 14 bits a turn; the slides resolve as finely at an arm's length.
_STEPS = np.repeat((1e-4, 2.0 * math.pi / 2**14), 3)
_ARM_FROM_ELW = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def config(elbow: dict[str, object] | None = None, **estimator: object) -> StationConfig:
    disks = ((214, 40, 57), (124, 181, 24), (0, 158, 165), (122, 62, 180))
    marker = {"half_spacing_m": 0.018, "disk_radius_m": 0.008, "plate_m": 0.06, "disk_rgb": disks}
    return StationConfig.model_validate(
        {
            "format": 1,
            "station": {"id": "test", "arm": "right"},
            "exoskeleton": {"urdf": "free.urdf"},
            "markers": {"m0": marker, "m1": marker},
            "cameras": {
                "r0": {"link": "l0", "marker": "m0", "device": {"backend": "sim"}},
                "r1": {"link": "l8", "marker": "m1", "device": {"backend": "sim"}},
            },
            "encoders": {"joints": JOINTS, "device": {"backend": "sim"}},
            "calibration": {
                "id": "exact",
                "link_from_camera": {name: T.tolist() for name, T in LINK_FROM_CAMERA.items()},
                "m0_from_gh": M0_FROM_GH.tolist(),
                "m1_from_elw": M1_FROM_ELW.tolist(),
            },
            "elbow": elbow,
            "estimator": estimator,
        }
    )


@dataclass(frozen=True)
class Pose:
    """The truth at one instant."""

    gh_from_arm: Array
    e_from_m0: Array
    e_from_m1: Array
    e_from_l8: Array
    joints: Array


def comb(t: float) -> tuple[float, float, float]:
    """Angles a, b, g with the amplitudes of the paper's COMB: 40, 90 and 60 degrees."""
    return (
        math.radians(20.0) * math.sin(2.0 * math.pi * 0.22 * t),
        math.radians(-20.0) + math.radians(45.0) * math.sin(2.0 * math.pi * 0.27 * t + 0.8),
        math.radians(30.0) * math.sin(2.0 * math.pi * 0.31 * t + 2.0),
    )


def rest(t: float) -> tuple[float, float, float]:
    return comb(1.0)


def nothing(t: float) -> Array:
    return np.eye(3)


def pose(angles: Callable[[float], tuple[float, float, float]], t_ns: int, beyond: Callable[[float], Array] = nothing) -> Pose:
    """The arm in the movement; the shoulder girdle follows it by a sixth, the forearm module keeps level and tilts a little.

    `beyond` is a rotation of the arm, in its own axes, that the exoskeleton does not go along with.
    """
    t = (t_ns - START) * 1e-9
    a, b, g = angles(t)
    carried = rot_y(a) @ rot_x(b) @ rot_z(g)
    gh = carried @ beyond(t)
    e_from_gh_R = rot_x(0.12 * b) @ rot_y(0.16 * a)
    p_gh = np.array([0.04, 0.025, -0.15]) + e_from_gh_R @ np.array([0.0, -0.14, 0.03])
    e_from_gh = transform(e_from_gh_R, p_gh)
    R = e_from_gh_R @ gh
    e_from_elw = transform(R @ _ARM_FROM_ELW, p_gh - LENGTH_M * R[:, 2])
    # The forearm module: turned with the arm but for most of its flexion; its pivot is not centred on the elbow.
    R = e_from_gh_R @ carried
    l8 = R @ rot_y(-0.8 * a) @ rot_z(0.05 * g + 0.05 * a)
    p_l8 = p_gh - LENGTH_M * R[:, 2] + R @ np.array([-0.012, 0.004, 0.010]) - l8 @ np.array([0.0, -0.11, 0.0])
    # Its axes are such that its joints are far from their singularity where the arm's angles are at theirs.
    l8 = l8 @ rot_y(math.pi / 2)
    yaw, pitch, roll = _yxz(l8)
    joints = np.array([*p_l8, yaw, pitch, roll])
    return Pose(gh, e_from_gh @ inverse(M0_FROM_GH), e_from_elw @ inverse(M1_FROM_ELW), transform(l8, p_l8), joints)


def _yxz(R: Array) -> tuple[float, float, float]:
    return math.atan2(R[0, 2], R[2, 2]), -math.asin(R[1, 2]), math.atan2(R[1, 0], R[1, 1])


@dataclass(frozen=True)
class Drift:
    """A marker moved on its bone from some time on."""

    marker: str
    nominal_from_actual: Array
    from_s: float = 0.0


@dataclass(frozen=True)
class Blind:
    """A marker not seen for a while; its frames come without a pose, or not at all."""

    marker: str
    from_s: float
    to_s: float
    frames: bool = True


@dataclass(frozen=True)
class Trial:
    """One run."""

    duration_s: float = 8.0
    seed: int = 1
    angles: Callable[[float], tuple[float, float, float]] = comb
    rotation_deg: float = 0.05
    position_mm: float = 0.05
    rate_hz: float = 60.0
    latency_ms: tuple[float, float] = (20.0, 40.0)
    lag_ms: float = 0.0
    method: str = "fused"
    arm_length_m: float | None = None
    drifts: tuple[Drift, ...] = ()
    blind: tuple[Blind, ...] = ()
    beyond: Callable[[float], Array] = nothing
    encoder_step_ms: float = 15.6
    lost_rows: Container[int] = ()
    forearm: bool = False
    estimator: dict[str, object] = field(default_factory=dict)
    spoil: Callable[[MarkerObservation], MarkerObservation] = lambda observation: observation


@dataclass(frozen=True)
class Judged:
    """An estimate, asked for at its own instant (plus the lag), beside the truth."""

    t_s: float
    estimate: GhEstimate
    error_rad: Array | None

    @property
    def error_deg(self) -> float:
        assert self.error_rad is not None
        return math.degrees(float(np.linalg.norm(self.error_rad)))

    @property
    def sigma_deg(self) -> float:
        assert self.estimate.covariance is not None
        return math.degrees(math.sqrt(float(np.trace(self.estimate.covariance))))


def events(trial: Trial) -> list[tuple[int, MarkerObservation | EncoderSample]]:
    """All samples in the order of arrival."""
    rng = np.random.default_rng(trial.seed)
    end = START + round(trial.duration_s * 1e9)
    found: list[tuple[int, MarkerObservation | EncoderSample]] = []
    t, k = START - 100 * MS, 0
    while t < end:
        if k not in trial.lost_rows:
            joints = np.rint(pose(trial.angles, t, trial.beyond).joints / _STEPS) * _STEPS
            found.append((t + 2 * MS, EncoderSample(k, joints, t, t + 2 * MS, t)))
        t += round((trial.encoder_step_ms + 0.66 * float(np.clip(rng.standard_normal(), -3, 3))) * MS)
        k += 1
    sigma = np.repeat((math.radians(trial.rotation_deg), trial.position_mm * 1e-3), 3)
    for camera, marker, phase_ms in (("r0", "m0", 0.0), ("r1", "m1", 7.0)):
        for k in range(round(trial.duration_s * trial.rate_hz)):
            t = START + round(phase_ms * MS + k * 1e9 / trial.rate_hz)
            latency, noise = round(rng.uniform(*trial.latency_ms) * MS), sigma * rng.standard_normal(6)
            observation = _observe(
                trial, MarkerObservation(camera, marker, k, t, t + latency, MarkerStatus.NOT_FOUND), noise, sigma
            )
            if observation is not None:
                found.append((t + latency, trial.spoil(observation)))
    found.sort(key=lambda event: event[0])
    return found


def _observe(trial: Trial, unseen: MarkerObservation, noise: Array, sigma: Array) -> MarkerObservation | None:
    marker, t_s = unseen.marker, (unseen.t_capture_ns - START) * 1e-9
    outage = next((b for b in trial.blind if b.marker == marker and b.from_s <= t_s < b.to_s), None)
    if outage is not None:
        return unseen if outage.frames else None
    truth = pose(trial.angles, unseen.t_capture_ns, trial.beyond)
    T = truth.e_from_m0 if marker == "m0" else truth.e_from_m1
    for drift in trial.drifts:
        if drift.marker == marker and t_s >= drift.from_s:
            T = T @ drift.nominal_from_actual
    link = np.eye(4) if unseen.camera == "r0" else truth.e_from_l8
    T = inverse(link @ LINK_FROM_CAMERA[unseen.camera]) @ T
    T = transform(exp_so3(noise[:3]) @ T[:3, :3], T[:3, 3] + noise[3:])
    covariance = np.diag(sigma**2)
    return replace(unseen, status=MarkerStatus.OK, camera_from_marker=T, covariance=covariance, disks_used=4, depth_used=True)


def estimator_for(trial: Trial) -> GhEstimator:
    station = config(FOREARM if trial.forearm else None, **trial.estimator)
    period_ns = dict.fromkeys(("r0", "r1"), round(1e9 / trial.rate_hz))
    if trial.method == "fused":
        return FusedEstimator(ArmChain(station, URDF, "urdf", JOINTS), 100 * MS, period_ns, arm_length_m=trial.arm_length_m)
    rates = dict.fromkeys(period_ns, trial.rate_hz)
    return make_estimator(station, URDF, "urdf", JOINTS, method=trial.method, frame_rate_hz=rates)


def run(trial: Trial, estimator: GhEstimator | None = None) -> list[Judged]:
    """Estimates on the 66.6 Hz grid, each from what had arrived at its instant plus the lag."""
    estimator = estimator or estimator_for(trial)
    waiting = iter(events(trial))
    event = next(waiting, None)
    judged = []
    for k in range(round((trial.duration_s - 0.05) * 66.6)):
        t = START + round(k * 1e9 / 66.6)
        while event is not None and event[0] <= t + trial.lag_ms * MS:
            if isinstance(event[1], EncoderSample):
                estimator.add_encoder(event[1])
            else:
                estimator.add_marker(event[1])
            event = next(waiting, None)
        found = estimator.estimate(t)
        truth = pose(trial.angles, t, trial.beyond).gh_from_arm
        error = None if found.gh_from_arm is None else log_so3(truth @ found.gh_from_arm.T)
        judged.append(Judged((t - START) * 1e-9, found, error))
    return judged


def rms_deg(judged: list[Judged], from_s: float, to_s: float = math.inf) -> float:
    errors = [j.error_deg for j in judged if from_s <= j.t_s < to_s and j.error_rad is not None]
    return math.sqrt(sum(e * e for e in errors) / len(errors))


def slide(axis: int, metres: float = 0.02) -> Array:
    return transform(np.eye(3), metres * np.eye(3)[axis])


def turn(axis: int, degrees: float = 5.0) -> Array:
    return transform(exp_so3(math.radians(degrees) * np.eye(3)[axis]), np.zeros(3))


def spoilt(
    marker: str, frames: Container[int], spoil: Callable[[Array], Array]
) -> Callable[[MarkerObservation], MarkerObservation]:
    """For `Trial.spoil`: some frames' poses of a marker in its camera are other ones."""

    def maybe(observation: MarkerObservation) -> MarkerObservation:
        if observation.marker != marker or observation.seq not in frames or observation.camera_from_marker is None:
            return observation
        return replace(observation, camera_from_marker=spoil(observation.camera_from_marker))

    return maybe


def slipping(degrees: float, from_s: float, to_s: float) -> Callable[[MarkerObservation], MarkerObservation]:
    """For `Trial.spoil`: m1 turns about the line of the arm, evenly, between two instants."""
    on_line = transform(np.eye(3), M1_FROM_ELW[:3, 3])

    def turned(observation: MarkerObservation) -> MarkerObservation:
        if observation.marker != "m1" or observation.camera_from_marker is None:
            return observation
        t_s = (observation.t_capture_ns - START) * 1e-9
        share = min(max((t_s - from_s) / (to_s - from_s), 0.0), 1.0)
        slipped = on_line @ turn(1, share * degrees) @ inverse(on_line)
        return replace(observation, camera_from_marker=observation.camera_from_marker @ slipped)

    return turned
