"""What a patient does in a calibration session, as docs/calibration.md tells the therapist: movement CAL."""

import numpy as np

from ghest_rt.geometry.so3 import Array, rot_x, rot_y, rot_z
from ghest_rt.simulation.posture import Posture

NAME = "CAL"

_HOLD_S = 4.0
_STROKE_S = 1.8
_PAUSE_S = 0.2
_ELBOW_DEG = 90.0
_PRONATION_RAD = np.radians(10.0)
_SWAY_DEG = 0.15
# Channel (flexion a, abduction b, rotation g, elbow) and the extremes it goes to one after the other, degrees.
_EXERCISES = ((0, (-22.0, 18.0)), (1, (-45.0, 12.0)), (2, (24.0, -24.0)), (3, (25.0, -25.0)))


class CalibrationMotion:
    """Neutral posture with the elbow bent, then flexion, abduction, axial rotation, at last the elbow.

    The seed sets tempo, extremes and a little sway: nobody holds quite still.
    """

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng((seed, *NAME.encode()))
        times, values = [0.0, _HOLD_S], [np.zeros(4), np.zeros(4)]
        for channel, extremes in _EXERCISES:
            for extreme in (*extremes, 0.0):
                goal = values[-1].copy()
                goal[channel] = extreme * float(rng.uniform(0.9, 1.0))
                arrival_s = times[-1] + _STROKE_S * float(rng.uniform(0.85, 1.15))
                times += [arrival_s, arrival_s + _PAUSE_S]
                values += [goal, goal]
        self._times, self._values = np.array(times), np.array(values)
        self._sway_hz = rng.uniform(0.2, 1.0, (4, 2))
        self._sway_phase = rng.uniform(0.0, 2.0 * np.pi, (4, 2))

    @property
    def name(self) -> str:
        """What it is called in recordings."""
        return NAME

    @property
    def duration_s(self) -> float:
        """Length of the session."""
        return float(self._times[-1])

    def at(self, t_s: float) -> Posture:
        """Return the posture at `t_s`."""
        a, b, g, elbow = np.radians(self._angles_deg(t_s)).tolist()
        return Posture(
            thorax=np.eye(3),
            thorax_shift_m=np.zeros(3),
            clavicle_rad=(0.12 * b, -0.16 * a),  # the shoulder girdle follows, as in the movements of Table 2
            scapula=np.eye(3),
            gh=rot_y(a) @ rot_x(b) @ rot_z(g),
            elbow_rad=(float(np.radians(_ELBOW_DEG)) + elbow, float(_PRONATION_RAD)),
            wrist_rad=(0.0, 0.0),
        )

    def _angles_deg(self, t_s: float) -> Array:
        index = int(np.clip(np.searchsorted(self._times, t_s, side="right") - 1, 0, len(self._times) - 2))
        start, stop = self._times[index], self._times[index + 1]
        x = min(max((t_s - start) / (stop - start), 0.0), 1.0)
        blend = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)  # minimum jerk
        sway = np.sin(2.0 * np.pi * self._sway_hz * t_s + self._sway_phase).sum(axis=1)
        return np.asarray((1.0 - blend) * self._values[index] + blend * self._values[index + 1] + _SWAY_DEG * sway)
