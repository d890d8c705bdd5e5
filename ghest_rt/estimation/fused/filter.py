"""One measurement after the other into the belief: gate, update, agility, jumps; sections 3 to 5 of docs/fused-estimator.md."""

import math
from enum import StrEnum
from typing import TypeVar

import numpy as np

from ghest_rt.estimation.fused.belief import (
    ACROMION,
    ACROMION_RATE,
    ARM,
    ARM_RATE,
    BOTH_GH,
    GH,
    GH_IN_MARKER,
    GH_RATE,
    RATES,
    SIZE,
    Base,
    Belief,
    Streak,
)
from ghest_rt.estimation.fused.measurement import Innovation, innovation_of
from ghest_rt.estimation.fused.process import Process
from ghest_rt.estimation.fused.sighting import Sighting
from ghest_rt.estimation.fused.small import inverse_3, inverse_spd, whitened_3
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.so3 import Array

# Two outliers that differ by less than this show the same new place of a marker.
_SAME_RAD = math.radians(1.0)
_SAME_M = 0.003
# A marker contradicts the other where the normalised square (3 degrees of freedom) of the GH centre's innovation is above this.
_CONTRADICTION = 8.0
# Normalised innovations squared, per degree of freedom, above this are more than noise.
_USUAL_NIS = 1.5
# A marker that has been taken fewer times than this has not jumped: what was taken at first was wrong.
_BELIEVED = 8
# Shares of a surge, tried one after the other.
_SURGE_SHARES = (0.05, 0.3, 1.0)
# Standard deviations of a belief before the first pair of sightings.
_UNKNOWN_RAD, _UNKNOWN_M, _UNKNOWN_RAD_S, _UNKNOWN_M_S = 0.5, 0.2, 1.0, 0.3

# Diagonal of the positions in a flat (6, 6) matrix.
_POSITIONS = slice(21, 36, 7)
# Which error states are places of the GH centre, for rows of a gain.
_OF_PLACES = np.zeros((SIZE, 1), dtype=bool)
for _part in (GH, GH_RATE, BOTH_GH):
    _OF_PLACES[_part] = True

_Item = TypeVar("_Item")


class Outcome(StrEnum):
    """What became of a measurement."""

    TAKEN = "taken"
    OUTLIER = "outlier"  # too far from what was foretold
    JUMP = "jump"  # taken: the marker has moved on its bone
    REGAINED = "regained"  # taken after many outliers unlike each other: the body has moved as nothing foretold
    MISTAKEN = "mistaken"  # not taken: the first sightings have been wrong, start anew


class FusedFilter:
    """The error-state Kalman filter; holds no state of its own."""

    def __init__(self, tuning: Tuning, process: Process) -> None:
        """Prepare."""
        self.process = process
        self._tuning = tuning
        self._surge = _surges(tuning)

    def start(self, m0: Sighting, m1: Sighting, m0_from_gh: Array) -> Belief:
        """Return a belief from one sighting of each marker, at the later one's time.

        Args:
            m0: A sighting of marker m0.
            m1: One of marker m1, taken about then.
            m0_from_gh: (4, 4) GH joint frame in the m0 frame, by calibration.
        """
        newer = m0 if m0.t_ns > m1.t_ns else m1
        variance = np.empty(SIZE)
        variance[ACROMION] = variance[ARM] = _UNKNOWN_RAD**2
        variance[GH] = _UNKNOWN_M**2
        variance[RATES] = np.repeat((_UNKNOWN_RAD_S**2, _UNKNOWN_M_S**2, _UNKNOWN_RAD_S**2), 3)
        variance[BOTH_GH] = self._tuning.unknown_gh_m**2
        p_gh = (m0.pose @ m0_from_gh)[:3, 3]
        belief = Belief(
            t_ns=newer.t_ns,
            e_from_r1=newer.e_from_r1,
            e_from_marker=(m0.pose[:3, :3], m1.pose[:3, :3]),
            p_gh=p_gh,
            rates=np.zeros(9),
            gh_in_marker=(m0_from_gh[:3, 3], m1.pose[:3, :3].T @ (p_gh - m1.pose[:3, 3])),
            P=np.diag(variance),
            agility=(self._tuning.starting_agility, self._tuning.starting_agility),
            seen_ns=(m0.t_ns, m1.t_ns),
        )
        for sighting in (m0, m1):
            _Update(belief.P, innovation_of(belief, sighting.marker, sighting.pose), sighting.covariance).apply(belief)
        return belief

    def take(self, belief: Belief, sighting: Sighting) -> Outcome:
        """Move a belief on to a sighting's time and let it learn from the sighting; say what became of it."""
        self.process.advance(belief, sighting.t_ns, sighting.e_from_r1)
        which = sighting.marker
        innovation = innovation_of(belief, which, sighting.pose)
        foretold = _Update(belief.P, innovation, sighting.covariance)
        belief.nis = foretold.nis
        update = self._surged(foretold, belief.P, innovation, sighting)
        outcome = Outcome.TAKEN
        if not update.nis <= self._tuning.gate:
            in_marker = (innovation.residual.reshape(2, 3) @ belief.e_from_marker[which]).ravel()
            streak = _streak(belief.streaks[which], sighting.t_ns, in_marker)
            belief.streaks = _with(belief.streaks, which, streak)
            jumped = self._has_jumped(belief, streak, update, sighting.t_ns)
            if belief.taken[which] < _BELIEVED and streak.length >= self._tuning.jump_count:
                return Outcome.MISTAKEN
            if jumped:
                outcome = Outcome.JUMP
                moved = _moved_base(belief, which, sighting.pose, foretold.spread)
                belief.base = _with(belief.base, which, moved)
            elif streak.length >= self._tuning.regain_count:
                outcome = Outcome.REGAINED
            else:
                return Outcome.OUTLIER
            freed = self._freed(belief.P, which, everything=outcome is Outcome.JUMP)
            belief.e_from_marker = _with(belief.e_from_marker, which, sighting.pose[:3, :3])
            update = _Update(freed, innovation_of(belief, which, sighting.pose), sighting.covariance)
        update.apply(belief)
        belief.straighten(which)
        if outcome is Outcome.TAKEN:
            self._adapt(belief, which, foretold.turn_surprise())
            self._loosen(belief, which, foretold.place_surprise())
        belief.streaks = _with(belief.streaks, which, Streak())
        belief.seen_ns = _with(belief.seen_ns, which, sighting.t_ns)
        belief.taken = _with(belief.taken, which, belief.taken[which] + 1)
        return outcome

    def _surged(self, foretold: "_Update", P: Array, innovation: Innovation, sighting: Sighting) -> "_Update":
        """Return an update that allows for as much unforeseen movement as a surprising innovation calls for, and no more."""
        update = foretold
        for share in _SURGE_SHARES:
            if update.nis <= self._tuning.surprising:
                break
            update = _Update(P + share * self._surge[sighting.marker], innovation, sighting.covariance)
        return update

    def _adapt(self, belief: Belief, which: int, turn: Array) -> None:
        """Let the agility of a marker's body follow the innovations: alike in a row means that the belief lags behind.

        Args:
            belief: Changed in place.
            which: The marker.
            turn: (3,) innovation of its rotation, whitened.
        """
        tuning = self._tuning
        alike = min(max(float(turn @ belief.surprise[which]) / 3.0, -1.0), 3.0)
        excess = min(max(float(turn @ turn) / 3.0 - _USUAL_NIS, 0.0), 3.0)
        stillness = max(1.0 - belief.speed_rad_s / tuning.still_rad_s, 0.0)
        push = tuning.agility_gain * (alike + excess - tuning.agility_fall - stillness * tuning.agility_rest)
        agility = min(max(belief.agility[which] * math.exp(push), tuning.least_agility), tuning.most_agility)
        belief.agility = _with(belief.agility, which, agility)
        belief.surprise = _with(belief.surprise, which, turn)

    def _loosen(self, belief: Belief, which: int, place: Array) -> None:
        """Let the GH centre creep in the markers as long as m0 and m1 contradict each other about where it is.

        Args:
            belief: Changed in place.
            which: The marker.
            place: (3,) innovation of the GH centre's place by this marker, whitened.
        """
        tuning = self._tuning
        against = min(max(-float(place @ belief.strain[1 - which]) / 3.0, -1.0), 3.0)
        push = tuning.slack_gain * (against - tuning.slack_fall)
        belief.slack = min(max(belief.slack * math.exp(push), 1.0), tuning.most_slack)
        belief.strain = _with(belief.strain, which, place)

    def _has_jumped(self, belief: Belief, streak: Streak, surged: "_Update", t_ns: int) -> bool:
        """Return whether a marker that is seen where nobody expected it has moved on its bone, and not the bone with it.

        The bone's movement, however quick, is no news about the GH centre, which the other marker shows too. A marker that says
        otherwise, more than a surge explains, has moved; or one that has turned while the exoskeleton stands still.
        """
        if streak.count < self._tuning.jump_count or t_ns - streak.since_ns < self._tuning.jump_span_ns:
            return False
        place = surged.place_surprise()
        return float(place @ place) > _CONTRADICTION or belief.speed_rad_s < self._tuning.still_rad_s

    def _freed(self, P: Array, which: int, *, everything: bool) -> Array:
        """Return P for a marker whose orientation is open; with `everything`, also the GH centre in it; else its rates."""
        spans = [((ACROMION, ARM)[which], _UNKNOWN_RAD)]
        if everything:
            spans.append((GH_IN_MARKER[which], self._tuning.unknown_gh_m))
        else:
            spans.append(((ACROMION_RATE, ARM_RATE)[which], _UNKNOWN_RAD_S))
            spans += [(GH, _UNKNOWN_M), (GH_RATE, _UNKNOWN_M_S)] if which == 0 else []
        freed = P.copy()
        for part, sigma in spans:
            freed[part] = 0.0
            freed[:, part] = 0.0
            freed[part, part] = sigma**2 * np.eye(3)
        return freed


class _Update:
    """A Kalman update whose gain for positions leaves the believed rotation aside.

    Rotations and their rates take the optimal gain. The GH centre, in E and in the markers, is judged by the measured position
    together with the *measured* rotation: what of the position's innovation follows from the rotation's is taken out first. A
    belief that lags behind in a movement would otherwise teach a wrong GH centre, for good. Any gain may be used as long as
    the covariance is updated in Joseph's form.
    """

    def __init__(self, P: Array, innovation: Innovation, R: Array) -> None:
        H, T = innovation.H, innovation.without_rotation
        self._P, self._H_P = P, H.dot(P)
        self._residual, self._without_rotation = innovation.residual, T
        self.spread = self._H_P.dot(H.T) + R
        self.spread.ravel()[_POSITIONS] += innovation.bend_m2
        self._place_spread = T.dot(self.spread).dot(T.T)
        self._information = inverse_spd(self.spread)
        self.nis = float(self._residual.dot(self._information).dot(self._residual))

    def turn_surprise(self) -> Array:
        """Return the (3,) innovation of the rotation, whitened."""
        return whitened_3(self.spread[:3, :3], self._residual[:3])

    def place_surprise(self) -> Array:
        """Return the (3,) innovation of the position, judged by the measured rotation, whitened."""
        return whitened_3(self._place_spread, self._without_rotation.dot(self._residual))

    def apply(self, belief: Belief) -> None:
        """Correct a belief."""
        T, H_P = self._without_rotation, self._H_P
        gain = self._information.dot(H_P).T
        of_places = T.T.dot(inverse_3(self._place_spread)).dot(T.dot(H_P)).T
        np.copyto(gain, of_places, where=_OF_PLACES)
        # Joseph's (1 - K H) P (1 - K H)^T + K R K^T, multiplied out, and its symmetric part.
        P = gain.dot(self.spread.dot(gain.T) - 2.0 * H_P)
        P += self._P
        P += P.T
        P *= 0.5
        belief.P = P
        belief.shift(gain.dot(self._residual))


def _streak(streak: Streak, t_ns: int, residual: Array) -> Streak:
    # Compared with the first: a body that moves on leaves it behind, slowly or not.
    apart = residual - streak.residual
    if streak.count and np.linalg.norm(apart[:3]) < _SAME_RAD and np.linalg.norm(apart[3:]) < _SAME_M:
        return Streak(streak.count + 1, streak.length + 1, streak.since_ns, streak.residual)
    return Streak(1, streak.length + 1, t_ns, residual)


def _moved_base(belief: Belief, which: int, pose: Array, spread: Array) -> Base:
    """Return how a marker sits on its bone, now that it is seen at `pose` and the bone has gone on as foretold.

    Args:
        belief: At the sighting's time.
        which: The marker.
        pose: (4, 4) of the marker in E, measured.
        spread: (6, 6) covariance of what is measured against what was foretold.
    """
    base = belief.base[which]
    R = belief.e_from_marker[which]
    p = belief.p_gh - R @ belief.gh_in_marker[which]
    return Base(
        slide=base.slide + base.turn @ (R.T @ (pose[:3, 3] - p)),
        turn=base.turn @ R.T @ pose[:3, :3],
        slide_variance=base.slide_variance + float(np.trace(spread[3:, 3:])) / 3.0,
        turn_variance=base.turn_variance + float(np.trace(spread[:3, :3])) / 3.0,
        jumped=True,
    )


def _with(pair: tuple[_Item, _Item], which: int, item: _Item) -> tuple[_Item, _Item]:
    """Return a pair with one of its items replaced."""
    return (item, pair[1]) if which == 0 else (pair[0], item)


def _surges(tuning: Tuning) -> tuple[Array, Array]:
    """Return what a movement that no model foresees adds to P, for the body of m0 and of m1."""
    turn, rate = tuning.surge_rad**2, tuning.surge_rate_rad_s**2
    acromion, arm = np.zeros(SIZE), np.zeros(SIZE)
    acromion[ACROMION], acromion[ACROMION_RATE] = turn, rate
    acromion[GH], acromion[GH_RATE] = tuning.surge_m**2, tuning.surge_rate_m_s**2
    arm[ARM], arm[ARM_RATE] = turn, rate
    arm[GH], arm[GH_RATE] = acromion[GH], acromion[GH_RATE]
    return np.diag(acromion), np.diag(arm)
