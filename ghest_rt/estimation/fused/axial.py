"""Does m1 slip about the arm? The forearm on the exoskeleton tells; section 7 of docs/fused-estimator.md.

Skin follows the axial rotation of the humerus only in part, and a cuff may turn about the arm: both leave the GH centre where
it is in m1, so that nothing of the rest of the filter sees them. With the elbow bent, the forearm shows the axial rotation (the
second option of Wu et al. 2005 for the humerus' axes). It is known to a few degrees only, but what its disagreement with m1
*does*, while the arm rotates, tells the slip.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ghest_rt.estimation.fused.reference import Reference
from ghest_rt.estimation.fused.settled import Settled
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.so3 import Array, quat_wxyz

# Less than this of the forearm across the arm (a sine) says nothing about the arm's axial rotation.
_LEAST_SINE = 0.3

# Forearm and m1 disagree for a moment by as many times of what they may for long.
_USUAL = 2.0


@dataclass(frozen=True, slots=True)
class Slip:
    """How far the humerus has turned beyond what m1 shows, about its z axis.

    Attributes:
        lag: Slip per axial rotation that m1 shows, rad/rad; 0 without lag.
        lag_variance: Of that, (rad/rad)^2.
        shift_rad: Slip since the beginning that no rotation explains.
        shift_variance: Of that, rad^2.
        shifted: Probability that there is such a shift.
        offset_rad: Slip since the calibration that was there from the beginning.
        offset_variance: Of that, rad^2.
        offset_there: Probability that there is one.
        astray_variance: What forearm and m1 disagree by just now, beyond all that and what is usual: its square, rad^2.
    """

    lag: float = 0.0
    lag_variance: float = 0.0
    shift_rad: float = 0.0
    shift_variance: float = 0.0
    shifted: float = 0.0
    offset_rad: float = 0.0
    offset_variance: float = 0.0
    offset_there: float = 0.0
    astray_variance: float = 0.0

    def at(self, twist_rad: float) -> tuple[float, float]:
        """Return slip (rad) and its variance (rad^2) where m1 shows an axial rotation of `twist_rad`."""
        slip = self.lag * twist_rad + self.shift_rad + self.offset_rad
        variance = self.lag_variance * twist_rad**2 + self.shift_variance + self.offset_variance + self.astray_variance
        return slip, variance

    def explained(self, share: float) -> "Slip":
        """Return the slip when a share of what was there from the beginning is a turn of m1 that has been taken out already."""
        left = 1.0 - share
        return replace(self, offset_rad=left * self.offset_rad, offset_variance=left * self.offset_variance)


class AxialJudge:
    """Regresses the disagreement between forearm and m1 on the axial rotation; slip there is only if the data insist."""

    def __init__(self, tuning: Tuning, reference: Reference | None = None) -> None:
        """Start without samples.

        Args:
            tuning: Priors.
            reference: The calibration session.
        """
        self._tuning = tuning
        self._reference = reference or Reference()
        # Disagreement of forearm and m1, the twist that m1 shows, and by how much a carrying angle weighs in the disagreement.
        self._settled = Settled(3, tuning.reference_s, tuning.axial_memory_s)
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
        sine = math.hypot(x, z)
        if sine < _LEAST_SINE:
            self.slip = replace(self.slip, astray_variance=0.0)
            return
        # The elbow's axis is the frame's x: the forearm lies in its y-z plane but for the slip and what is constant.
        apart = math.atan2(x, z) if z > 0.0 else math.atan2(-x, -z)
        dt = self._settled.add(t_ns, np.array([apart, twist_rad, 1.0 / sine]))
        if dt == 0.0:
            return
        recent_apart, recent_twist, recent_weight = self._settled.recent.tolist()
        # An elbow that bends quickly looks like a slip of the carrying angle's.
        if self._tolerance_rad2(1.0 / sine - recent_weight) < 2.0 * self._tolerance_rad2(0.0):
            rapid_apart, rapid_twist = apart - recent_apart, twist_rad - recent_twist
            kept = math.exp(-dt / self._tuning.lag_memory_s)
            self._squares = kept * self._squares + dt * rapid_twist * rapid_twist
            self._products = kept * self._products + dt * rapid_twist * rapid_apart
        self._decide(apart, twist_rad, 1.0 / sine)

    def _tolerance_rad2(self, weight: float) -> float:
        """Return the variance that is no slip, where a carrying angle weighs differently by so much."""
        return self._tuning.axial_tolerance_rad**2 + (self._tuning.carrying_rad * weight) ** 2

    def _decide(self, apart: float, twist: float, weight: float) -> None:
        tuning = self._tuning
        if self._squares <= 0.0:
            return
        noise = tuning.axial_noise_rad2_s / self._squares + tuning.lag_tolerance**2
        lag = self._products / self._squares
        lag, lag_variance, _ = _judged(lag, noise, tuning.lag_sigma**2, tuning.lag_cost)
        shift, shift_variance, shifted, astray = 0.0, 0.0, 0.0, 0.0
        if self._settled.ready:
            first_apart, first_twist, first_weight = self._settled.first.tolist()
            recent_apart, recent_twist, recent_weight = self._settled.recent.tolist()
            found = recent_apart - first_apart - lag * (recent_twist - first_twist)
            tolerance = self._tolerance_rad2(recent_weight - first_weight)
            shift, shift_variance, shifted = _judged(found, tolerance, tuning.axial_shift_rad**2, tuning.axial_shift_cost)
            # Means lag behind a sudden slip: until they tell, it is in the variance.
            left = apart - first_apart - lag * (twist - first_twist) - shift
            astray = max(left * left - _USUAL**2 * self._tolerance_rad2(weight - first_weight), 0.0)
        self.slip = Slip(lag, lag_variance, shift, shift_variance, shifted, *self._offset(), astray)

    def turned(self) -> tuple[float, float] | None:
        """Return how far m1 has turned about the arm since the calibration, and the variance (rad, rad^2); None if unknown."""
        if self._reference.forearm_rad is None or not self._settled.started:
            return None
        apart, twist, weight = self._settled.first.tolist()
        variance = self._reference.forearm_sigma_rad**2 + self._tolerance_rad2(weight - 1.0)
        return self._reference.forearm_rad - (apart - self.slip.lag * twist), variance

    def _offset(self) -> tuple[float, float, float]:
        """Return the slip that was there from the beginning, its variance (rad, rad^2) and probability.

        What the forearm tells is hardly more certain than what it is to show. The slip is taken out only as far as it is
        likelier than not; its variance says, at lower odds against it, that it may be there all the same.
        """
        turned = self.turned()
        if turned is None:
            return 0.0, 0.0, 0.0
        found, noise = -turned[0], turned[1]
        prior = self._tuning.axial_offset_rad**2
        cost = self._tuning.axial_offset_cost
        mean, there = found * prior / (noise + prior), _probability(found, noise, prior, cost)
        taken = max(2.0 * there - 1.0, 0.0) * mean
        doubt = _probability(found, noise, prior, cost - self._tuning.axial_offset_doubt)
        remains = doubt * (noise * prior / (noise + prior) + (mean - taken) ** 2) + (1.0 - doubt) * taken**2
        return taken, remains, there


def twist_rad(gh_from_arm: Array) -> float:
    """Return the axial rotation of the arm against the neutral posture (swing-twist), -pi to pi."""
    w, _, _, z = quat_wxyz(gh_from_arm)
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
    probability = _probability(found, noise, prior, cost)
    if probability < 0.02:
        return 0.0, 0.0, 0.0
    mean = found * prior / total
    return probability * mean, probability * (noise * prior / total + (1.0 - probability) * mean * mean), probability


def _probability(found: float, noise: float, prior: float, cost: float) -> float:
    """Return how likely it is that something found is there; arguments as of `_judged`."""
    total = noise + prior
    gain = found * found * (1.0 / noise - 1.0 / total) - math.log(total / noise) - cost
    return 1.0 / (1.0 + math.exp(min(-0.5 * gain, 50.0)))
