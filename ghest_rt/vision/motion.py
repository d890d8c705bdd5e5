"""Where the marker will be: constant velocity over the short time between frames."""

import numpy as np

from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, exp_so3, log_so3

_MAX_AGE_S = 0.5  # after this long unseen the marker may be anywhere
_COAST_S = 0.1  # beyond this the velocity says nothing any more
_FRESH = 0.7  # weight of the newest velocity


class MotionTrack:
    """The last pose of one marker in one camera and its velocity."""

    def __init__(self) -> None:
        self._t_ns = 0
        self._pose: Array | None = None
        self._spin_rad_s = np.zeros(3)
        self._speed_m_s = np.zeros(3)
        self._moving = False

    def reset(self) -> None:
        """Forget everything."""
        self._pose = None
        self._moving = False
        self._spin_rad_s = np.zeros(3)
        self._speed_m_s = np.zeros(3)

    def update(self, t_ns: int, pose: Array) -> None:
        """Take in a pose (4, 4) in the camera frame, measured at `t_ns`."""
        if self._pose is not None:
            dt_s = (t_ns - self._t_ns) * 1e-9
            if 0.0 < dt_s <= _COAST_S:
                spin = log_so3(pose[:3, :3] @ self._pose[:3, :3].T) / dt_s
                speed = (pose[:3, 3] - self._pose[:3, 3]) / dt_s
                fresh = _FRESH if self._moving else 1.0
                self._spin_rad_s = fresh * spin + (1.0 - fresh) * self._spin_rad_s
                self._speed_m_s = fresh * speed + (1.0 - fresh) * self._speed_m_s
                self._moving = True
            else:
                self.reset()
        self._t_ns = t_ns
        self._pose = pose

    def predict(self, t_ns: int) -> Array | None:
        """Return the pose (4, 4) expected at `t_ns`; None if there is none, or it is too long ago."""
        if self._pose is None:
            return None
        dt_s = (t_ns - self._t_ns) * 1e-9
        if not 0.0 <= dt_s <= _MAX_AGE_S:
            return None
        return self.advance(self._pose, min(dt_s, _COAST_S))

    def advance(self, pose: Array, dt_s: float) -> Array:
        """Return `pose` (4, 4) moved on by the present velocity for `dt_s` (which may be negative)."""
        if not self._moving:
            return pose
        return transform(exp_so3(dt_s * self._spin_rad_s) @ pose[:3, :3], pose[:3, 3] + dt_s * self._speed_m_s)
