"""The exoskeleton follows the patient through its cuffs: inverse kinematics on a dense grid.

Two cuffs: the exoskeleton's elbow pivot keeps its place against the upper arm (position: 3 equations, met by j0, j1, j2), and
the forearm module keeps the direction of the forearm (2 equations, met by j4, j6). Neither cuff is centred on the anatomy.
Pro/supination and wrist follow the hand.
"""

import math

import mink
import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from ghest_rt.errors import GhestError
from ghest_rt.geometry.so3 import Array
from ghest_rt.simulation.posture import Motion
from ghest_rt.simulation.scene import Scene, exoskeleton_spec, refusals_told

_RATE_HZ = 100.0
_PAD_S = 0.15
_ELBOW_CUFF_M = np.array([-0.012, 0.004, 0.010])  # the exoskeleton's elbow pivot in the humerus' axes, from the elbow centre
_FOREARM_CUFF_RAD = (math.radians(2.0), math.radians(-1.5))  # tilt of the forearm module against the forearm, about its x and z
_START_RAD = {"j0": -0.7, "j1": 1.2}  # the outer branch: the links swing out to the side, away from the torso
_TOLERANCE = 2e-6
_FIRST_ITERATIONS = 200
_ITERATIONS = 20
_DT_S = 1.0
_REFUSAL_M = 0.005

LINKS = frozenset(("l5", "l8"))
"""The links of the cuffs: any exoskeleton that follows the patient has them."""

JOINTS = frozenset(("j0", "j1", "j8", "j9"))
"""The joints that the coupling starts from, and those of pro/supination and wrist."""


class ExoskeletonMotion:
    """Joint positions of the exoskeleton over a movement: a spline, which *is* the truth at every instant.

    Args:
        scene: The clinic.
        motion: What the patient does.
        duration_s: How much of the movement is wanted.
        settings_m: Prismatic joints set for the patient.
        urdf_text: The exoskeleton.
        source: Where it came from, for messages.

    Raises:
        GhestError: The exoskeleton cannot follow this movement.
    """

    def __init__(
        self,
        scene: Scene,
        motion: Motion,
        *,
        duration_s: float,
        settings_m: dict[str, float],
        urdf_text: str,
        source: str,
    ) -> None:
        self._names = tuple(scene.joint_address)
        step_s = 1.0 / _RATE_HZ
        times = np.arange(-_PAD_S, duration_s + _PAD_S + step_s, step_s)
        follower = _Follower(scene, settings_m, urdf_text, source)
        self._spline = CubicSpline(times, np.array([follower.solve(motion, float(t)) for t in times]))
        self._fixed = {self._names.index(name): value for name, value in settings_m.items()}
        self._mimics = follower.mimics

    @property
    def names(self) -> tuple[str, ...]:
        """All joints, in the order of `at`."""
        return self._names

    def at(self, t_s: float) -> Array:
        """Return the (n,) joint positions at `t_s`, radians or metres; settings and mimic joints hold exactly."""
        q = np.asarray(self._spline(t_s), dtype=np.float64)
        for index, value in self._fixed.items():
            q[index] = value
        for index, leader, multiplier in self._mimics:
            q[index] = multiplier * q[leader]
        return q


class _Follower:
    """Solves the coupling posture by posture, each from the one before."""

    def __init__(self, scene: Scene, settings_m: dict[str, float], urdf_text: str, source: str) -> None:
        with refusals_told(source):
            model = exoskeleton_spec(urdf_text, source).compile()
        self._scene = scene
        self._data = mujoco.MjData(scene.model)
        self._names = tuple(scene.joint_address)
        self._index = {name: int(model.joint(name).qposadr[0]) for name in self._names}
        self.mimics = tuple(
            (self._position(model, model.eq_obj1id[k]), self._position(model, model.eq_obj2id[k]), float(model.eq_data[k, 1]))
            for k in range(model.neq)
            if model.eq_type[k] == mujoco.mjtEq.mjEQ_JOINT
        )
        self._sign = 1.0 if scene.side == "right" else -1.0
        start = np.zeros(model.nq)
        for name, value in {**_START_RAD, **settings_m}.items():
            start[self._index[name]] = value
        self._configuration = mink.Configuration(model, q=start)
        self._elbow = mink.FrameTask("l5", "body", position_cost=1.0, orientation_cost=0.0)
        self._forearm = mink.AxisAlignTask("l8", "body", axis=(0.0, self._sign, 0.0), cost=0.3)
        frozen = [self._index[name] for name in (*settings_m, "j8", "j9")]
        self._constraints = [mink.DofFreezingTask(model, dof_indices=frozen), mink.EqualityConstraintTask(model, cost=1.0)]
        self._limits = [mink.ConfigurationLimit(model)]
        self._first = True

    def solve(self, motion: Motion, t_s: float) -> Array:
        """Return the joint positions at `t_s`."""
        scene, data = self._scene, self._data
        posture = motion.at(t_s)
        scene.pose_patient(data, posture)
        mujoco.mj_kinematics(scene.model, data)
        arm, forearm = data.body("humerus"), data.body("forearm")
        cuff = np.asarray(arm.xmat).reshape(3, 3) @ (_ELBOW_CUFF_M * (1.0, self._sign, 1.0))
        elbow_m = np.asarray(forearm.xpos) + cuff
        tilt_x, tilt_z = _FOREARM_CUFF_RAD
        direction = np.asarray(forearm.xmat).reshape(3, 3) @ np.array([tilt_z, tilt_x * self._sign, -1.0])
        self._elbow.set_target(mink.SE3.from_translation(elbow_m))
        self._forearm.set_target(direction / np.linalg.norm(direction))
        for _ in range(_FIRST_ITERATIONS if self._first else _ITERATIONS):
            velocity = mink.solve_ik(
                self._configuration,
                [self._elbow, self._forearm],
                _DT_S,
                solver="daqp",
                damping=1e-9,
                limits=self._limits,
                constraints=self._constraints,
            )
            self._configuration.integrate_inplace(velocity, _DT_S)
            if float(np.abs(velocity).max()) < _TOLERANCE:
                break
        off_m = float(np.linalg.norm(self._configuration.data.body("l5").xpos - elbow_m))
        if off_m > _REFUSAL_M:
            raise GhestError(
                f"the exoskeleton cannot follow the patient at {t_s:.2f} s: its elbow stays {off_m * 1000:.0f} mm away; "
                "check exoskeleton.settings_m against the patient's height, or use a movement within its reach"
            )
        self._first = False
        q = np.array([self._configuration.q[self._index[name]] for name in self._names])
        q[self._names.index("j8")] = posture.elbow_rad[1]
        q[self._names.index("j9")] = posture.wrist_rad[0]
        return q

    def _position(self, model: mujoco.MjModel, joint_id: int) -> int:
        return self._names.index(model.joint(joint_id).name)
