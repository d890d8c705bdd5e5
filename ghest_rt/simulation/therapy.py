"""The paper's four movements (Table 2) as smooth, therapy-like repetitions."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from ghest_rt.errors import BadInputError
from ghest_rt.geometry.so3 import Array, rot_x, rot_y, rot_z
from ghest_rt.simulation.posture import Posture

PAPER_RATE_HZ = 66.6
_GRID_S = 0.02
_PAD_S = 0.5
_CYCLES_PER_S = 0.22  # a repetition takes about four and a half seconds
_ELBOW_RAD = np.radians(90.0)
_PRONATION_RAD = np.radians(10.0)


@dataclass(frozen=True, slots=True)
class TherapyMovement:
    """One row of Table 2.

    Attributes:
        name: The paper's abbreviation.
        amplitude_deg: Peak to peak of the GH joint's y, x and z angles (flexion, horizontal abduction, rotation).
        centre_deg: Their mid positions, chosen for natural postures of a right arm.
        main: Index of the angle that is exercised; the others accompany it. None where all are.
        samples: Number of samples at 66.6 Hz.
    """

    name: str
    amplitude_deg: tuple[float, float, float]
    centre_deg: tuple[float, float, float]
    main: int | None
    samples: int

    @property
    def duration_s(self) -> float:
        """Length of the movement."""
        return self.samples / PAPER_RATE_HZ


MOVEMENTS = {
    movement.name: movement
    for movement in (
        TherapyMovement("SAbAd", (6.0, 31.0, 10.0), (8.0, -8.0, 0.0), 1, 1000),
        TherapyMovement("SFE", (31.0, 8.0, 1.0), (4.0, -4.0, 0.0), 0, 1000),
        TherapyMovement("SIR", (3.0, 3.0, 34.0), (6.0, -4.0, 0.0), 2, 1000),
        TherapyMovement("COMB", (40.0, 90.0, 60.0), (0.0, -20.0, 0.0), None, 2000),
    )
}


def find_movement(name: str) -> TherapyMovement:
    """Return a movement of Table 2 by its name, in any case of letters.

    Raises:
        BadInputError: There is none of that name.
    """
    for movement in MOVEMENTS.values():
        if movement.name.lower() == name.lower():
            return movement
    raise BadInputError(f"movement {name!r} is unknown: give one of {', '.join(MOVEMENTS)}, or --motion FILE")


class TherapyMotion:
    """A movement of Table 2 performed once; the seed sets phases, tempo and pauses, never the amplitude.

    The GH angles are cubic splines in time: `gh = Ry(a) Rx(b) Rz(g)` exactly, at any instant.
    """

    def __init__(self, movement: TherapyMovement, seed: int) -> None:
        rng = np.random.default_rng((seed, *movement.name.encode()))
        t = np.arange(-_PAD_S, movement.duration_s + _PAD_S + _GRID_S, _GRID_S)
        inside = (t >= 0.0) & (t <= movement.duration_s)
        count = 3 if movement.main is None else 1
        drives = [_repetitions(t, rng, 1.0 + 0.17 * index) for index in range(count)]
        columns = []
        for axis in range(3):
            if movement.main is None:
                shape = drives[axis]
            elif axis == movement.main:
                shape = drives[0]
            else:
                shape = _companion(t, drives[0], rng)
            low, high = shape[inside].min(), shape[inside].max()
            unit = (shape - (low + high) / 2) / (high - low)
            columns.append(movement.centre_deg[axis] + movement.amplitude_deg[axis] * unit)
        abg = np.radians(np.array(columns).T)
        elbow = _ELBOW_RAD + np.radians(4.0) * _companion(t, drives[0], rng)
        pronation = _PRONATION_RAD + np.radians(8.0) * _companion(t, drives[0], rng)
        wrist = np.radians(5.0) * np.array([_companion(t, drives[0], rng) for _ in range(2)]).T
        # Shoulder girdle: it follows the arm by about a sixth, protracting as the arm comes across and rising as it lifts.
        girdle = np.column_stack((0.12 * (abg[:, 1] - abg[:, 1].mean()), -0.16 * (abg[:, 0] - abg[:, 0].mean())))
        self._spline = CubicSpline(t, np.column_stack((abg, girdle, elbow, pronation, wrist)))
        self._movement = movement

    @property
    def name(self) -> str:
        """The paper's abbreviation."""
        return self._movement.name

    @property
    def duration_s(self) -> float:
        """Length of the movement."""
        return self._movement.duration_s

    def angles_rad(self, t_s: float) -> Array:
        """Return (a, b, g) of the GH joint at `t_s`, right arm."""
        return np.asarray(self._spline(t_s)[:3], dtype=np.float64)

    def at(self, t_s: float) -> Posture:
        """Return the posture at `t_s`."""
        a, b, g, protraction, elevation, elbow, pronation, flexion, deviation = (float(v) for v in self._spline(t_s))
        return Posture(
            thorax=np.eye(3),
            thorax_shift_m=np.zeros(3),
            clavicle_rad=(protraction, elevation),
            scapula=np.eye(3),
            gh=rot_y(a) @ rot_x(b) @ rot_z(g),
            elbow_rad=(elbow, pronation),
            wrist_rad=(flexion, deviation),
        )


def _repetitions(t: Array, rng: np.random.Generator, tempo: float) -> Array:
    """Return to-and-fro movement: minimum-jerk strokes between two extremes that vary a little, with short pauses."""
    times, values = [float(t[0])], [float(rng.uniform(-1.0, 1.0))]
    end = 1.0 if rng.random() < 0.5 else -1.0
    while times[-1] < t[-1]:
        stroke = rng.uniform(0.8, 1.25) / (2.0 * _CYCLES_PER_S * tempo)
        times.append(times[-1] + stroke)
        values.append(end * rng.uniform(0.85, 1.0))
        times.append(times[-1] + rng.uniform(0.05, 0.35))
        values.append(values[-1])
        end = -end
    index = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
    start, stop = np.take(times, index), np.take(times, index + 1)
    x = (t - start) / (stop - start)
    blend = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    first, last = np.take(values, index), np.take(values, index + 1)
    return np.asarray(first + (last - first) * blend, dtype=np.float64)


def _companion(t: Array, drive: Array, rng: np.random.Generator) -> Array:
    """Return a movement within about [-1, 1] that goes along with another, with some slow wandering of its own."""
    phase = rng.uniform(0.0, 2 * np.pi, 2)
    rate_hz = rng.uniform(0.06, 0.18, 2)
    wander = sum(np.sin(2 * np.pi * rate_hz[k] * t + phase[k]) for k in range(2))
    return np.asarray(rng.choice((-0.5, 0.5)) * drive + 0.25 * wander, dtype=np.float64)
