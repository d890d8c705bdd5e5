"""A station made of geometry alone: known postures, exact markers, a two-joint exoskeleton written out by hand."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from ghest_drivers.samples import EncoderSample
from ghest_rt.config.load import LoadedStation
from ghest_rt.config.station import StationConfig
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import exp_so3, rot_x, rot_y, rot_z
from ghest_rt.messages.results import MarkerObservation, MarkerStatus

MS = 1_000_000

URDF = """<robot name="two_joints">
  <link name="l0"/><link name="l4"/><link name="l8"/>
  <joint name="yaw" type="revolute">
    <parent link="l0"/><child link="l4"/><axis xyz="1 0 0"/><limit lower="-2" upper="2"/>
  </joint>
  <joint name="reach" type="continuous">
    <parent link="l4"/><child link="l8"/><origin xyz="0.02 0.05 -0.3"/><axis xyz="0 1 0"/>
  </joint>
</robot>"""


def random_transform(rng: np.random.Generator, reach_m: float = 0.3) -> np.ndarray:
    return transform(exp_so3(rng.normal(size=3)), rng.uniform(-reach_m, reach_m, size=3))


@dataclass(frozen=True)
class Posture:
    """Where everything truly is at one instant."""

    e_from_m0: np.ndarray
    e_from_m1: np.ndarray
    e_from_arm: np.ndarray
    gh_from_arm: np.ndarray
    joints_rad: np.ndarray


class Clinic:
    """Station, calibration and the truth; makes the observations that a faultless system would make."""

    def __init__(self, seed: int = 0, **estimator: Any) -> None:
        rng = np.random.default_rng(seed)
        self.link_from_camera = {"r0": random_transform(rng), "r1": random_transform(rng)}
        self.m0_from_gh = transform(exp_so3(0.3 * rng.normal(size=3)), [-0.06, 0.01, -0.03])
        self.m1_from_elw = transform(exp_so3(0.3 * rng.normal(size=3)), [0.0, -0.07, -0.04])
        disks = ((214, 40, 57), (124, 181, 24), (0, 158, 165), (122, 62, 180))
        marker = {"half_spacing_m": 0.018, "disk_radius_m": 0.008, "plate_m": 0.06, "disk_rgb": disks}
        self.config = StationConfig.model_validate(
            {
                "format": 1,
                "station": {"id": "test", "arm": "right"},
                "exoskeleton": {"urdf": "two_joints.urdf"},
                "markers": {"m0": marker, "m1": marker},
                "cameras": {
                    "r0": {"link": "l0", "marker": "m0", "device": {"backend": "sim"}},
                    "r1": {"link": "l8", "marker": "m1", "device": {"backend": "sim"}},
                },
                "encoders": {"joints": ["yaw", "reach"], "device": {"backend": "sim"}},
                "calibration": {
                    "id": "exact",
                    "link_from_camera": {name: T.tolist() for name, T in self.link_from_camera.items()},
                    "m0_from_gh": self.m0_from_gh.tolist(),
                    "m1_from_elw": self.m1_from_elw.tolist(),
                },
                "estimator": estimator,
            }
        )
        self.urdf = URDF
        self.station = LoadedStation(self.config, "", URDF, "test station")

    def posture(self, gh_from_arm: np.ndarray, e_from_m0: np.ndarray, joints_rad: np.ndarray, length_m: float = 0.3) -> Posture:
        e_from_gh = e_from_m0 @ self.m0_from_gh
        R = e_from_gh[:3, :3] @ gh_from_arm
        p_elw = e_from_gh[:3, 3] - length_m * R[:, 2]
        # Elbow frame: y along the arm, x = the arm's x, z = x × y (docs/frames.md).
        e_from_elw = transform(np.column_stack([R[:, 0], R[:, 2], -R[:, 1]]), p_elw)
        e_from_arm = transform(R, 0.5 * (e_from_gh[:3, 3] + p_elw))
        return Posture(e_from_m0, e_from_elw @ inverse(self.m1_from_elw), e_from_arm, gh_from_arm, joints_rad)

    def random_posture(self, rng: np.random.Generator) -> Posture:
        return self.posture(
            exp_so3(rng.normal(size=3)), random_transform(rng), rng.uniform(-1.5, 1.5, size=2), float(rng.uniform(0.2, 0.4))
        )

    def moving(self, t_ns: int) -> Posture:
        """A smooth movement of everything."""
        t = t_ns * 1e-9
        gh = rot_y(0.4 * np.sin(2.0 * t)) @ rot_x(0.5 * np.sin(1.3 * t + 1.0)) @ rot_z(0.6 * np.sin(1.7 * t))
        e_from_m0 = transform(
            exp_so3(np.array([0.1, 0.2, 0.1]) * np.sin(t)), np.array([0.1, 0.2, 0.3]) + 0.02 * np.sin(1.1 * t)
        )
        return self.posture(gh, e_from_m0, np.array([0.5 * np.sin(1.9 * t), 0.4 * np.cos(1.5 * t)]))

    def e_from_camera(self, camera: str, joints_rad: np.ndarray) -> np.ndarray:
        if camera == "r0":
            return self.link_from_camera["r0"]
        e_from_l4 = transform(rot_x(joints_rad[0]), [0.0, 0.0, 0.0])
        l4_from_l8 = transform(rot_y(joints_rad[1]), [0.02, 0.05, -0.3])
        return e_from_l4 @ l4_from_l8 @ self.link_from_camera["r1"]

    def observation(
        self, camera: str, posture: Posture, t_ns: int, *, seen: bool = True, latency_ms: float = 1.0, **fields: Any
    ) -> MarkerObservation:
        e_from_marker = posture.e_from_m0 if camera == "r0" else posture.e_from_m1
        fields = {"status": MarkerStatus.OK if seen else MarkerStatus.NOT_FOUND, "disks_used": 4, "depth_used": True} | fields
        if seen:
            fields.setdefault("camera_from_marker", inverse(self.e_from_camera(camera, posture.joints_rad)) @ e_from_marker)
            fields.setdefault("covariance", np.diag([1e-8] * 3 + [1e-10] * 3))
        arrival_ns = t_ns + round(latency_ms * MS)
        return MarkerObservation(camera, "m0" if camera == "r0" else "m1", t_ns // MS, t_ns, arrival_ns, **fields)

    def encoder(self, posture: Posture, t_ns: int, seq: int | None = None) -> EncoderSample:
        return EncoderSample(t_ns // 1000 if seq is None else seq, posture.joints_rad.copy(), t_ns, t_ns + MS // 2, t_ns)


@pytest.fixture
def make_clinic() -> Callable[..., Clinic]:
    return Clinic
