"""How the belief moves on in time; section 2 of docs/fused-estimator.md."""

import math

import numpy as np

from ghest_rt.estimation.fused.belief import ACROMION, ARM, BOTH_GH, GH, GH_IN_MARKER, GH_RATE, POSES, RATES, SIZE, Belief
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.so3 import Array, exp_so3, quat_wxyz, rotation, skew

# A marker not seen for this long is bridged: its body may do what it has not done before.
_UNSEEN_NS = 80_000_000
# Over how long the exoskeleton's speed is averaged: encoder steps are no movement.
_SPEED_MEMORY_S = 0.2
# Keeps the shortest rotation finite between opposite directions, which no forecast joins.
_LEAST = 1e-6
_EYE = np.eye(SIZE)
_EYE_3 = np.eye(3)
# Diagonals of blocks in the flat covariance.
_POSE, _GH, _RATE = (slice(part.start * (SIZE + 1), part.stop * (SIZE + 1), SIZE + 1) for part in (POSES, BOTH_GH, RATES))
_POSE_RATE = slice(RATES.start, RATES.start + 9 * (SIZE + 1), SIZE + 1)
# Which of the poses move with m0: the acromion, and the GH centre.
_OF_M0 = np.repeat((1.0, 0.0), (6, 3))
_RATE_POSE = slice(RATES.start * SIZE, RATES.start * SIZE + 9 * (SIZE + 1), SIZE + 1)
# A slack above this is a contradiction between the markers that no movement explains.
_CLEAR_SLACK = 8.0


class Process:
    """Rates that decay (Ornstein-Uhlenbeck), an arm that follows the encoders, markers that creep on their bones."""

    def __init__(self, tuning: Tuning, elbow_in_m1: Array) -> None:
        """Prepare the constants.

        Args:
            tuning: Noise.
            elbow_in_m1: (3,) elbow centre in the m1 frame, by calibration.
        """
        self._elbow_in_m1 = elbow_in_m1
        self._memory_s = tuning.rate_memory_s
        self._bridging = tuning.bridging_agility
        self._jerk_s, self._jerky_agility = tuning.jerk_s, tuning.jerky_agility
        density = np.repeat((tuning.rotation_density, tuning.position_density, tuning.rotation_density), 3)
        self._density = np.array([density * _OF_M0, density * (1.0 - _OF_M0)])
        self._loose_m2_s = tuning.loose_m2_s
        self._creep = np.empty(6)
        for part, creep in zip(GH_IN_MARKER, tuning.creep_m2_s, strict=True):
            self._creep[part.start - BOTH_GH.start : part.stop - BOTH_GH.start] = creep
        self._most = tuning.unknown_gh_m**2

    def advance(self, belief: Belief, t_ns: int, e_from_r1: Array, *, doubt: float = 1.0) -> None:
        """Move a belief on to `t_ns`; nothing happens if it is not later.

        Args:
            belief: Moved on in place.
            t_ns: The instant.
            e_from_r1: (4, 4) camera r1 in E at `t_ns`: the encoders' part in the forecast.
            doubt: Factor on the process noise.
        """
        dt = (t_ns - belief.t_ns) * 1e-9
        if dt <= 0.0:
            return
        tau = self._memory_s
        decay = math.exp(-dt / tau)
        carry = tau * (1.0 - decay)
        move = carry * belief.rates
        p_gh = belief.p_gh + move[GH]
        m0, m1 = belief.e_from_marker
        upper_arm = m1.dot(belief.gh_in_marker[1] - self._elbow_in_m1)
        follow, turned_rad = follow_encoders(belief, upper_arm, p_gh, e_from_r1)
        smoothing = min(dt / _SPEED_MEMORY_S, 1.0)
        belief.speed_rad_s += smoothing * (turned_rad / dt - belief.speed_rad_s)
        belief.e_from_marker = (exp_so3(move[ACROMION]).dot(m0), exp_so3(move[ARM]).dot(follow).dot(m1))
        belief.p_gh = p_gh
        belief.rates = decay * belief.rates
        belief.e_from_r1 = e_from_r1
        F = _EYE.copy()
        diagonal = F.ravel()
        diagonal[_POSE_RATE] = carry
        diagonal[_RATE] = decay
        F[ARM, ARM] = follow
        F[ARM, GH_RATE] = skew(upper_arm * (carry / float(upper_arm.dot(upper_arm))))
        belief.P = F.dot(belief.P).dot(F.T)
        self._disturb(belief, dt, decay, t_ns, doubt)
        belief.t_ns = t_ns

    def _disturb(self, belief: Belief, dt: float, decay: float, t_ns: int, doubt: float) -> None:
        """Add the process noise: exact for the decaying rates, a random walk for the creep."""
        tau = self._memory_s
        fresh = 0.5 * tau * (1.0 - decay * decay)
        carry = tau * (1.0 - decay)
        smooth, jerky = tau * tau * (dt - 2.0 * carry + fresh), dt * self._jerk_s * self._jerk_s
        agility_0, agility_1 = self._agility(belief, 0, t_ns), self._agility(belief, 1, t_ns)
        # Quick movement is also jerky: part of what a pose does is none of its rate's doing.
        pose_0 = smooth + jerky * agility_0 / (agility_0 + self._jerky_agility)
        pose_1 = smooth + jerky * agility_1 / (agility_1 + self._jerky_agility)
        cross = 0.5 * carry * carry
        driven_0, driven_1 = doubt * agility_0, doubt * agility_1
        posed, rated, crossed = np.array(
            [[driven_0 * pose_0, driven_1 * pose_1], [driven_0 * fresh, driven_1 * fresh], [driven_0 * cross, driven_1 * cross]]
        ).dot(self._density)
        flat_P = belief.P.ravel()
        flat_P[_POSE] += posed
        flat_P[_RATE] += rated
        flat_P[_POSE_RATE] += crossed
        flat_P[_RATE_POSE] += crossed
        creep = flat_P[_GH]
        if max(creep.tolist()) < self._most:
            creep += (dt * belief.slack) * self._creep + dt * max(belief.slack - _CLEAR_SLACK, 0.0) * self._loose_m2_s

    def _agility(self, belief: Belief, which: int, t_ns: int) -> float:
        unseen = t_ns - belief.seen_ns[which] > _UNSEEN_NS
        return max(belief.agility[which], self._bridging[which]) if unseen else belief.agility[which]


def follow_encoders(belief: Belief, upper_arm: Array, p_gh: Array, e_from_r1: Array) -> tuple[Array, float]:
    """Return the (3, 3) rotation of the arm that the encoders tell, E axes, and the angle that camera r1 has turned by, rad.

    The elbow keeps its place in camera r1, and so moves with the exoskeleton: that turns the arm's direction, by the shortest
    way. About the arm, the humerus turns with r1.

    Args:
        belief: Before the movement.
        upper_arm: (3,) from the elbow to the GH centre before it, E axes, m.
        p_gh: (3,) GH centre after it.
        e_from_r1: (4, 4) camera r1 after it.
    """
    before = belief.e_from_r1
    moved = e_from_r1[:3, :3].dot(before[:3, :3].T)
    p_elbow = moved.dot(belief.p_gh - upper_arm - before[:3, 3]) + e_from_r1[:3, 3]
    ax, ay, az = _unit(upper_arm)
    bx, by, bz = _unit(p_gh - p_elbow)
    # Shortest rotation from V to W: I + [c]x + [c]x^2 / (1 + V.W), c = V x W.
    cx, cy, cz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    k = 1.0 / max(1.0 + ax * bx + ay * by + az * bz, _LEAST)
    xy, xz, yz = k * cx * cy, k * cx * cz, k * cy * cz
    swing = np.array(
        [
            [1.0 - k * (cy * cy + cz * cz), xy - cz, xz + cy],
            [xy + cz, 1.0 - k * (cx * cx + cz * cz), yz - cx],
            [xz - cy, yz + cx, 1.0 - k * (cx * cx + cy * cy)],
        ]
    )
    w, x, y, z = quat_wxyz(moved)
    twist = 2.0 * math.atan2(x * ax + y * ay + z * az, w)
    return swing.dot(rotation(twist * ax, twist * ay, twist * az)), 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), w)


def _unit(v: Array) -> tuple[float, float, float]:
    x, y, z = v.tolist()
    size = math.sqrt(max(x * x + y * y + z * z, _LEAST))
    return x / size, y / size, z / size
