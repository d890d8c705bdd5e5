"""What cameras, encoders and the truth need of a moving scene."""

from typing import Protocol

import mujoco

from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import TruthSample


class Stage(Protocol):
    """A moving scene. Immutable: who asks brings the `MjData` to work in, so that threads do not meet."""

    @property
    def model(self) -> mujoco.MjModel:
        """The MuJoCo model; its world frame is E."""
        ...

    def joints(self, t_s: float) -> dict[str, float]:
        """Return the exoskeleton's joint positions at `t_s` of the movement, radians or metres."""
        ...

    def place(self, data: mujoco.MjData, t_s: float) -> None:
        """Put everything in `data` where it is at `t_s` of the movement."""
        ...

    def e_from_camera(self, data: mujoco.MjData, camera: str) -> Array:
        """Return the (4, 4) pose of a colour camera."""
        ...

    def e_from_marker(self, data: mujoco.MjData, marker: str) -> Array:
        """Return the (4, 4) pose of a marker."""
        ...

    def truth(self, data: mujoco.MjData, t_s: float, t_ns: int) -> TruthSample:
        """Return the truth at `t_s` of the movement, `t_ns` of the recording."""
        ...
