"""Does m1 slip about the arm? The forearm on the exoskeleton tells; section 7 of docs/fused-estimator.md.

Skin follows the axial rotation of the humerus only in part, and a cuff may turn about the arm: both leave the GH centre where
it is in m1, so that nothing of the rest of the filter sees them. With the elbow bent, the forearm shows the axial rotation (the
second option of Wu et al. 2005 for the humerus' axes). It is known to a few degrees only, but what its disagreement with m1
*does*, while the arm rotates, tells the slip.
"""

import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.estimation.fused.settled import Settled
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.so3 import Array, quat_wxyz_from_matrix

# Less than this of the forearm across the arm (a sine) says nothing about the arm's axial rotation.
_LEAST_SINE = 0.3


@dataclass(frozen=True, slots=True)
class Slip:
    """How far the humerus has turned beyond what m1 shows, about its z axis.

    Attributes:
        lag: Slip per axial rotation that m1 shows, rad/rad; 0 without lag.
        lag_variance: Of that, (rad/rad)^2.
        shift_rad: Slip since the beginning that no rotation explains.
        shift_variance: Of that, rad^2.
        shifted: Probability that there is such a shift.
    """

    lag: float = 0.0
    lag_variance: float = 0.0
    shift_rad: float = 0.0
    shift_variance: float = 0.0
    shifted: float = 0.0

    def at(self, twist_rad: float) -> tuple[float, float]:
        """Return slip (rad) and its variance (rad^2) where m1 shows an axial rotation of `twist_rad`."""
        return self.lag * twist_rad + self.shift_rad, self.lag_variance * twist_rad**2 + self.shift_variance


class AxialJudge:
    """Regresses the disagreement between forearm and m1 on the axial rotation; slip there is only if the data insist."""

    def __init__(self, tuning: Tuning) -> None:
        """Start without samples."""
        self._tuning = tuning
        # Disagreement of forearm and m1, and the twist that m1 shows.
        self._settled = Settled(2, tuning.reference_s, tuning.axial_memory_s)
        # Integrals of the rapid parts: twist^2 and twist * disagreement, rad^2 s.
        self._squares = self._products = 0.0
        self.slip = Slip()

    def add(self, t_ns: int, elw_from_forearm: Array, twist_rad: float) -> None:
        """Take what one sighting of m1 shows.

        Args:
            t_ns: Its capture time.
            elw_from_forearm: (3,) unit vector from elbow to wrist, in the axes of the elbow frame as m1 shows it.
            twist_rad: Axial rotation of the arm as m1 shows it.
        """
        x, _, z = elw_from_forearm.tolist()
        if math.hypot(x, z) < _LEAST_SINE:
            return
        # The elbow's axis is the frame's x: the forearm lies in its y-z plane but for the slip and what is constant.
        apart = math.atan2(x, z) if z > 0.0 else math.atan2(-x, -z)
        dt = self._settled.add(t_ns, np.array([apart, twist_rad]))
        if dt == 0.0:
            return
        rapid_apart, rapid_twist = apart - float(self._settled.recent[0]), twist_rad - float(self._settled.recent[1])
        kept = math.exp(-dt / self._tuning.lag_memory_s)
        self._squares = kept * self._squares + dt * rapid_twist * rapid_twist
        self._products = kept * self._products + dt * rapid_twist * rapid_apart
        self._decide()

    def _decide(self) -> None:
        tuning = self._tuning
        if self._squares <= 0.0:
            return
        noise = tuning.axial_noise_rad2_s / self._squares + tuning.lag_tolerance**2
        lag = self._products / self._squares
        lag, lag_variance, _ = _judged(lag, noise, tuning.lag_sigma**2, tuning.lag_cost)
        shift, shift_variance, shifted = 0.0, 0.0, 0.0
        if self._settled.ready:
            apart, twist = (self._settled.recent - self._settled.first).tolist()
            shift, shift_variance, shifted = _judged(
                apart - lag * twist, tuning.axial_tolerance_rad**2, tuning.axial_shift_rad**2, tuning.axial_shift_cost
            )
        self.slip = Slip(lag, lag_variance, shift, shift_variance, shifted)


def twist_rad(gh_from_arm: Array) -> float:
    """Return the axial rotation of the arm against the neutral posture (swing-twist), -pi to pi."""
    w, _, _, z = quat_wxyz_from_matrix(gh_from_arm).tolist()
    return 2.0 * math.atan2(z, w)


def _judged(found: float, noise: float, prior: float, cost: float) -> tuple[float, float, float]:
    """Return mean, variance and probability of a quantity that may as well not be there.

    Args:
        found: As measured.
        noise: Variance of that.
        prior: Variance of the quantity if it is there.
        cost: Twice the logarithm of the odds against it.
    """
    total = noise + prior
    gain = found * found * (1.0 / noise - 1.0 / total) - math.log(total / noise) - cost
    probability = 1.0 / (1.0 + math.exp(min(-0.5 * gain, 50.0)))
    if probability < 0.02:
        return 0.0, 0.0, 0.0
    mean = found * prior / total
    return probability * mean, probability * (noise * prior / total + (1.0 - probability) * mean * mean), probability
