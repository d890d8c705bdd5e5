"""Rival 2: inverse kinematics of the human limb and the exoskeleton as one closed chain, after EIKPE (the paper's [16])."""

import mink
import mujoco
import numpy as np

from ghest_rt.geometry.so3 import Array, matrix_from_quat_wxyz
from ghest_rt.simulation.scene import build_scene
from ghest_rt.studies.rivals.neutral import NeutralCalibration, NeutralMotion

# The cuffs hold; the girdle stays where it is as far as they let it (weights of squared metres and radians).
_CUFF_COST = 1.0
_GIRDLE_COST = 0.01
_DAMPING = 1e-4
_DT_S = 1.0
_FIRST_ITERATIONS = 30
_ITERATIONS = 4
_TOLERANCE_RAD = 1e-4
_ARM_DOFS = ("patient_protraction", "patient_elevation", "patient_gh", "patient_elbow")


class CoupledChain:
    """The patient's limb follows the cuffs: two degrees of freedom of the girdle, three of the GH joint, one of the elbow.

    The upper arm's cuff keeps the exoskeleton's elbow pivot (link l5) where it is on the humerus, the forearm's keeps the
    direction of the forearm module (link l8) on the forearm. Both are taken from the neutral posture. Of the postures that
    satisfy them, the one with the girdle nearest to rest is chosen; the trunk stands still.
    """

    def __init__(self, calibration: NeutralCalibration) -> None:
        self._calibration = calibration
        station = calibration.station
        self._scene = build_scene(station.config, station.urdf_text, station.source, calibration.body)
        model = self._scene.model
        data = mujoco.MjData(model)
        self._scene.pose_patient(data, NeutralMotion().at(0.0))
        self._configuration = mink.Configuration(model, q=data.qpos.copy())
        self._put_exoskeleton(calibration.joints)
        elbow = mink.RelativeFrameTask("l5", "body", "humerus", "body", position_cost=_CUFF_COST, orientation_cost=0.0)
        # The forearm may turn about its length (l8's y axis) in its cuff.
        turn_cost = (0.3 * _CUFF_COST, 0.0, 0.3 * _CUFF_COST)
        forearm = mink.RelativeFrameTask("l8", "body", "forearm", "body", position_cost=0.0, orientation_cost=turn_cost)
        for cuff in (elbow, forearm):
            cuff.set_target_from_configuration(self._configuration)
        free = self._dofs(model)
        girdle = np.zeros(model.nv)
        girdle[free[:2]] = _GIRDLE_COST
        rest = mink.PostureTask(model, cost=girdle)
        rest.set_target(self._configuration.q)
        self._tasks = [elbow, forearm, rest]
        self._frozen = [mink.DofFreezingTask(model, dof_indices=sorted(set(range(model.nv)) - set(free)))]
        self._gh = int(model.joint("patient_gh").qposadr[0])
        self._first = True

    def gh_from_arm(self, joints: Array) -> Array:
        """See `PostureModel`."""
        self._put_exoskeleton(joints)
        for _ in range(_FIRST_ITERATIONS if self._first else _ITERATIONS):
            velocity = mink.solve_ik(
                self._configuration,
                self._tasks,
                _DT_S,
                solver="daqp",
                damping=_DAMPING,
                limits=[],
                constraints=self._frozen,
            )
            self._configuration.integrate_inplace(velocity, _DT_S)
            if float(np.abs(velocity).max()) < _TOLERANCE_RAD:
                break
        self._first = False
        return matrix_from_quat_wxyz(self._configuration.q[self._gh : self._gh + 4])

    def _put_exoskeleton(self, joints: Array) -> None:
        q = self._configuration.q.copy()
        positions = {**self._calibration.station.config.exoskeleton.settings_m, **self._calibration.named(joints)}
        positions["j3"] = -positions["j2"]
        for name, address in self._scene.joint_address.items():
            q[address] = positions[name]
        self._configuration.update(q)

    @staticmethod
    def _dofs(model: mujoco.MjModel) -> list[int]:
        """Return the degrees of freedom that are solved for, the girdle's first."""
        sizes = {"patient_gh": 3}
        starts = [(int(model.joint(name).dofadr[0]), sizes.get(name, 1)) for name in _ARM_DOFS]
        return [start + k for start, size in starts for k in range(size)]
