"""Where everything is at any instant: patient and exoskeleton moving together, cameras, markers, and the truth."""

import mujoco
import numpy as np

from ghest_rt.config.station import StationConfig
from ghest_rt.geometry.se3 import inverse, transform
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import TruthSample
from ghest_rt.simulation.attachment import Attachment
from ghest_rt.simulation.coupling import ExoskeletonMotion
from ghest_rt.simulation.disturbances import MARKERS
from ghest_rt.simulation.posture import Motion
from ghest_rt.simulation.scene import Scene


class Clinic:
    """The moving scene. Immutable: who asks brings the `MjData` to work in, so that threads do not meet.

    Args:
        scene: The model.
        station: Where the cameras are.
        motion: What the patient does.
        exoskeleton: How the exoskeleton follows.
        attachment: Where the markers are; None where the calibration says.
    """

    def __init__(
        self,
        scene: Scene,
        station: StationConfig,
        motion: Motion,
        exoskeleton: ExoskeletonMotion,
        attachment: Attachment | None = None,
    ) -> None:
        self.scene = scene
        self._motion = motion
        self._exoskeleton = exoskeleton
        self._attachment = attachment
        self._addresses = [scene.joint_address[name] for name in exoskeleton.names]
        self._cameras = {
            name: (scene.model.body(camera.link).id, station.calibration.link_from_camera_array(name))
            for name, camera in station.cameras.items()
        }
        self._markers = {
            "m0": (scene.model.body("scapula").id, scene.scapula_from_m0),
            "m1": (scene.model.body("humerus").id, scene.humerus_from_m1),
        }
        if attachment is not None:
            self._markers = {name: (body, np.eye(4)) for name, (body, _) in scene.mounts.items()}
        self._humerus = scene.model.body("humerus").id
        self._scapula = scene.model.body("scapula").id
        self._arm_in_humerus = transform(np.eye(3), (0.0, 0.0, -scene.anatomy.upper_arm_m / 2))

    @property
    def model(self) -> mujoco.MjModel:
        """The MuJoCo model."""
        return self.scene.model

    @property
    def duration_s(self) -> float:
        """Length of the movement."""
        return self._motion.duration_s

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The exoskeleton's joints."""
        return self._exoskeleton.names

    def joints(self, t_s: float) -> dict[str, float]:
        """Return the exoskeleton's joint positions, radians or metres."""
        return dict(zip(self._exoskeleton.names, self._exoskeleton.at(t_s).tolist(), strict=True))

    def place(self, data: mujoco.MjData, t_s: float) -> None:
        """Put everything in `data` where it is at `t_s` of the movement."""
        posture = self._motion.at(t_s)
        self.scene.pose_patient(data, posture)
        data.qpos[self._addresses] = self._exoskeleton.at(t_s)
        if self._attachment is not None:
            for marker in MARKERS:
                self.scene.move_plate(data, marker, self._attachment.nominal_from_marker(marker, t_s, posture))
        mujoco.mj_kinematics(self.scene.model, data)

    def e_from_camera(self, data: mujoco.MjData, camera: str) -> Array:
        """Return the (4, 4) pose of a colour camera."""
        body, link_from_camera = self._cameras[camera]
        return _pose(data, body) @ link_from_camera

    def e_from_marker(self, data: mujoco.MjData, marker: str) -> Array:
        """Return the (4, 4) pose of a marker."""
        body, body_from_marker = self._markers[marker]
        return _pose(data, body) @ body_from_marker

    def truth(self, data: mujoco.MjData, t_s: float, t_ns: int) -> TruthSample:
        """Return the truth at `t_s` of the movement, `t_ns` of the recording."""
        self.place(data, t_s)
        e_from_scapula, e_from_arm = _pose(data, self._scapula), _pose(data, self._humerus) @ self._arm_in_humerus
        scapula_from_arm = inverse(e_from_scapula) @ e_from_arm
        # The scapula body's frame is the GH frame: origin in the joint, E's axes in the neutral posture.
        m0_from_arm = self.scene.m0_from_gh @ scapula_from_arm
        return TruthSample(
            t_ns=t_ns,
            gh_from_arm=scapula_from_arm[:3, :3],
            m0_from_arm=m0_from_arm,
            e_from_m0=self.e_from_marker(data, "m0"),
            e_from_m1=self.e_from_marker(data, "m1"),
            e_from_arm=e_from_arm,
            joints_rad=self.joints(t_s),
            elbow_rad=self._motion.at(t_s).elbow_rad,
        )


def _pose(data: mujoco.MjData, body: int) -> Array:
    return transform(data.xmat[body].reshape(3, 3), data.xpos[body])
