"""The example of another limb: a seated person's right knee in an orthosis, as config/examples/knee describes it.

The orthosis' hinge is not the knee's axis: the knee's centre stands some millimetres beside it and glides as the knee bends,
the shank also turns and tilts, and the strap lets the shank run ahead of the bar. None of this is in the calibration.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import Array, exp_so3, quat_wxyz_from_matrix, rot_x, rot_y, rot_z
from ghest_rt.messages.results import TruthSample
from ghest_rt.simulation.scene import add_plate, add_room, arm_from_elw, exoskeleton_spec, refusals_told

JOINT = "knee"
DURATION_S = 20.0
_SHANK_M = 0.40
_THIGH_M = 0.40
_SKIN = (0.80, 0.62, 0.52, 1.0)
_CENTRE_M = np.array([0.008, 0.004, -0.006])  # knee centre off the hinge, E
_GLIDE_M = np.array([-0.004, 0.0, 0.006])  # of the thigh in its cuff with the knee at right angles, E
_REPETITIONS_PER_S = 0.2


@dataclass(frozen=True, slots=True)
class KneeMotion:
    """Stretching and bending the knee; phases by seed. Angles: a (flexion), b (adduction), g (internal rotation)."""

    phase: tuple[float, float, float]

    @classmethod
    def from_seed(cls, seed: int) -> "KneeMotion":
        """Return the motion of a seed."""
        first, second, third = np.random.default_rng((seed, 7)).uniform(0.0, 2.0 * math.pi, 3)
        return cls((float(first), float(second), float(third)))

    def angles_rad(self, t_s: float) -> tuple[float, float, float]:
        """Return (a, b, g) at a time."""
        turn = 2.0 * math.pi * _REPETITIONS_PER_S * t_s
        a = math.radians(50.0 - 45.0 * math.cos(turn + self.phase[0]))
        b = math.radians(3.0 * math.sin(1.3 * turn + self.phase[1]))
        g = 0.12 * a + math.radians(3.0 * math.sin(0.7 * turn + self.phase[2]))
        return a, b, g


class KneeStage:
    """The moving leg in the orthosis.

    Args:
        station: The station file; its calibration says where markers and cameras are.
        motion: What the patient does.

    Raises:
        BadInputError: The station is not that of a right leg with one hinge k0.
    """

    def __init__(self, station: LoadedStation, motion: KneeMotion) -> None:
        config = station.config
        if config.station.arm != "right" or config.encoders.joints != ("k0",):
            raise BadInputError(
                f'{station.source}: the simulated knee is a right one with encoders.joints = ["k0"]; correct that'
            )
        self._motion = motion
        self._settings_m = config.exoskeleton.settings_m
        self._m0_from_gh = np.array(config.calibration.m0_from_gh)
        thigh_from_m0 = inverse(self._m0_from_gh)
        shank_from_m1 = _SHANK_FROM_MIDDLE @ arm_from_elw(_SHANK_M) @ inverse(np.array(config.calibration.m1_from_elw))
        spec = exoskeleton_spec(station.urdf_text, station.source)
        with refusals_told(station.source):
            add_room(spec)
            _add_leg(spec)
        self._markers: dict[str, tuple[int, Array]] = {}
        for marker, body, pose in (("m0", "thigh", thigh_from_m0), ("m1", "shank", shank_from_m1)):
            depth = np.array([0.0, 0.0, pose[2, 3]])  # the stalk ends on the bone's axis
            add_plate(spec.body(body), marker, pose, config.markers[marker].plate_m, depth)
        with refusals_told(station.source):
            self._model = spec.compile()
        for marker, body, pose in (("m0", "thigh", thigh_from_m0), ("m1", "shank", shank_from_m1)):
            self._markers[marker] = (self._model.body(body).id, pose)
        self._cameras = {
            name: (self._model.body(camera.link).id if camera.link != config.exoskeleton.base_link else 0, name)
            for name, camera in config.cameras.items()
        }
        self._link_from_camera = {name: config.calibration.link_from_camera_array(name) for name in config.cameras}

    @property
    def model(self) -> mujoco.MjModel:
        """The MuJoCo model."""
        return self._model

    def joints(self, t_s: float) -> dict[str, float]:
        """Return the orthosis' joints: the bar lags behind the shank by up to 2 degrees, as the strap gives."""
        a, _, _ = self._motion.angles_rad(t_s)
        return {"k0": a - math.radians(2.0) * math.sin(a), **self._settings_m}

    def place(self, data: mujoco.MjData, t_s: float) -> None:
        """Put leg and orthosis where they are at `t_s` of the movement."""
        for name, value in self.joints(t_s).items():
            data.joint(name).qpos[0] = value
        thigh, shank = self._leg(t_s)
        for name, pose in (("leg_thigh", thigh), ("leg_shank", shank)):
            data.joint(name).qpos[:] = [*pose[:3, 3], *quat_wxyz_from_matrix(pose[:3, :3])]
        mujoco.mj_kinematics(self._model, data)

    def e_from_camera(self, data: mujoco.MjData, camera: str) -> Array:
        """Return the (4, 4) pose of a colour camera."""
        body, name = self._cameras[camera]
        return _pose(data, body) @ self._link_from_camera[name]

    def e_from_marker(self, data: mujoco.MjData, marker: str) -> Array:
        """Return the (4, 4) pose of a marker."""
        body, body_from_marker = self._markers[marker]
        return _pose(data, body) @ body_from_marker

    def truth(self, data: mujoco.MjData, t_s: float, t_ns: int) -> TruthSample:
        """Return the truth at `t_s` of the movement, `t_ns` of the recording: `gh` is the knee, `arm` the shank."""
        self.place(data, t_s)
        thigh, shank = self._leg(t_s)
        e_from_shank_middle = shank @ _SHANK_FROM_MIDDLE
        thigh_from_shank_middle = inverse(thigh) @ e_from_shank_middle
        return TruthSample(
            t_ns=t_ns,
            gh_from_arm=thigh_from_shank_middle[:3, :3],
            m0_from_arm=self._m0_from_gh @ thigh_from_shank_middle,
            e_from_m0=self.e_from_marker(data, "m0"),
            e_from_m1=self.e_from_marker(data, "m1"),
            e_from_arm=e_from_shank_middle,
            joints_rad=self.joints(t_s),
        )

    def _leg(self, t_s: float) -> tuple[Array, Array]:
        """Return the (4, 4) poses of thigh and shank, both with their origin in the knee's centre, in E."""
        a, b, g = self._motion.angles_rad(t_s)
        bent = math.sin(0.5 * a) ** 2 * 2.0
        thigh = transform(exp_so3(np.array([0.01, -0.03 - 0.02 * bent, 0.02])), _CENTRE_M + bent * _GLIDE_M)
        return thigh, thigh @ transform(rot_y(a) @ rot_x(b) @ rot_z(g), np.zeros(3))


_SHANK_FROM_MIDDLE = transform(np.eye(3), (0.0, 0.0, -_SHANK_M / 2))


def _add_leg(spec: mujoco.MjSpec) -> None:
    """Add thigh and shank as free bodies."""
    for name, start, end, radius in (
        ("thigh", (0.0, 0.0, 0.03), (0.0, 0.0, _THIGH_M), 0.062),
        ("shank", (0.0, 0.0, -0.03), (0.0, 0.0, -_SHANK_M), 0.042),
    ):
        body = spec.worldbody.add_body(name=name, mass=1.0, inertia=(1.0, 1.0, 1.0), ipos=(0, 0, 0))
        body.add_freejoint(name=f"leg_{name}")
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=(*start, *end), size=(radius, 0, 0), rgba=_SKIN, group=1, mass=0
        )


def _pose(data: mujoco.MjData, body: int) -> Array:
    return transform(data.xmat[body].reshape(3, 3), data.xpos[body])
