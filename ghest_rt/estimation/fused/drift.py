"""Has a marker moved on its bone, and where is the bone then? Section 6 of docs/fused-estimator.md."""

import math
from typing import NamedTuple

import numpy as np

from ghest_rt.estimation.fused.answers import (
    DRIFT_SIZE,
    ELBOW,
    FIRST_ELBOW,
    LENGTH,
    ROWS,
    SLIDE,
    TURN,
    TWIST,
    Answers,
    Explained,
)
from ghest_rt.estimation.fused.belief import ACROMION, ARM, GH, POSES, Base, Belief
from ghest_rt.estimation.fused.small import inverse_spd
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.estimation.fused.weighing import Weighing
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, exp_so3, log_so3

# What a posture consists of: scapula, GH centre, humerus, drift.
_BONES = 9
_POSTURE = _BONES + DRIFT_SIZE
# What it depends on: of the belief's error states the poses, and what drift explains, of which the belief has the GH centre in
# the markers.
_KNOWN = _BONES + ROWS
_FOUND = slice(_BONES, _KNOWN)
_BELIEVED = _BONES + 6
# Diagonal of what is told besides, in the flat covariance.
_TOLD = slice(_BELIEVED * (_KNOWN + 1), _KNOWN * _KNOWN, _KNOWN + 1)
# Variance of what is not known, m^2 and rad^2.
_ANYTHING = 1e2
_FROM_POSES = np.eye(_POSTURE, _KNOWN)
_FROM_DRIFT = np.eye(_POSTURE, DRIFT_SIZE, -_BONES)
# A turn that is likelier than this counts in the covariance, even if it is not taken out.
_DOUBTFUL = 1e-2
# A marker that has jumped is back if it is within this of where it was.
_BACK_M, _BACK_RAD = 0.003, math.radians(1.0)


class Evidence(NamedTuple):
    """What is told of m1 besides where the GH centre is in it; axes of m1 as calibrated; None where it is not known.

    Attributes:
        elbow_moved: (3,) how far the elbow, as m1 shows it, has moved in camera r1 since the beginning, m.
        elbow_moved_m2: Variance of that without drift, per axis.
        first_elbow: (3,) how far it was displaced there during the first seconds, against the calibration session, m.
        first_elbow_m2: Variance of that without drift, per axis.
        twist_rad: How far m1 has turned about the arm's axis (elbow to GH centre) since the calibration, by the forearm.
        twist_rad2: Variance of that without a turn.
    """

    elbow_moved: Array | None
    elbow_moved_m2: float
    first_elbow: Array | None
    first_elbow_m2: float
    twist_rad: float | None
    twist_rad2: float


class Posture(NamedTuple):
    """The bones, and the drift that was taken out.

    Attributes:
        e_from_gh: (4, 4) GH joint frame in E, equation (8).
        e_from_elw: (4, 4) elbow frame in E, equation (9).
        covariance: (22, 22) of the errors of scapula (rad, left, E axes), GH centre (m, E axes), humerus (rad, left, E axes),
            and drift: slide (m, nominal marker axes) and turn (rad, marker axes) of m0, of m1, arm length (m).
        slide: (3,) of m0 and m1, in the axes of the marker as calibrated, m.
        turn: (3,) of m0 and m1: rotation vector of calibrated_from_actual, rad.
        drifted: Probability that m0, and that m1, is not where calibration says.
        turned: Probability that m1 has been turned from the beginning.
    """

    e_from_gh: Array
    e_from_elw: Array
    covariance: Array
    slide: tuple[Array, Array]
    turn: tuple[Array, Array]
    drifted: tuple[float, float]
    turned: float


class DriftJudge:
    """Weighs which of slide and turn of m0 and m1 there are: by how well each answer explains where the GH centre is found."""

    def __init__(self, tuning: Tuning, m0_from_gh: Array, m1_from_elw: Array, arm_length_m: float | None) -> None:
        """Prepare the answers; arguments as of `Answers`."""
        self._m0_from_gh = m0_from_gh
        self._m1_from_elw = m1_from_elw
        self._answers = Answers(tuning, m0_from_gh, m1_from_elw, arm_length_m)
        self._weighing = Weighing(self._answers)
        self._doubt = np.zeros((_POSTURE, _POSTURE))

    def judge(self, belief: Belief, evidence: Evidence) -> Posture:
        """Return the bones as the mean over the answers, with the covariance of the mixture.

        Args:
            belief: The belief.
            evidence: What is told of m1 besides.
        """
        explained = self._answers.explained(belief)
        found = np.zeros(ROWS)
        found[:3], found[3:6] = belief.gh_in_marker
        found[:6] -= explained.expected
        variance = np.full(ROWS, _ANYTHING)
        for rows, value, known in (
            (TWIST, evidence.twist_rad, evidence.twist_rad2),
            (ELBOW, evidence.elbow_moved, evidence.elbow_moved_m2),
            (FIRST_ELBOW, evidence.first_elbow, evidence.first_elbow_m2),
        ):
            if value is not None:
                found[rows], variance[rows] = value, known
        P = np.zeros((_KNOWN, _KNOWN))
        P[:_BELIEVED, :_BELIEVED] = belief.P[:_BELIEVED, :_BELIEVED]
        P.ravel()[_TOLD] = variance[6:]
        weighing = self._weighing
        anew = weighing.weigh(belief.t_ns, P[_FOUND, _FOUND], explained, found, elbow_known=evidence.elbow_moved is not None)
        weights = weighing.probability
        kept = np.flatnonzero(weights)
        postures = [self._posture(belief, P, explained, int(h), found) for h in kept]
        mean, covariance = postures[0] if len(postures) == 1 else _mixture(weights[kept], postures)
        if anew:
            self._doubt = self._doubted(belief, P, explained, found, mean)
        return self._compose(belief, explained, mean, covariance + self._doubt, weights)

    def _doubted(self, belief: Belief, P: Array, explained: Explained, found: Array, mean: Array) -> Array:
        """Return the (22, 22) variance about the mean of turns that are too unlikely to be taken out, and too likely to ignore.

        Nothing rules out a small turn that leaves the GH centre where it is.
        """
        doubt = np.zeros((_POSTURE, _POSTURE))
        for h in np.flatnonzero((self._weighing.doubt > _DOUBTFUL) & (self._weighing.probability == 0.0)):
            shift, part = self._posture(belief, P, explained, int(h), found)
            apart = shift - mean
            doubt += self._weighing.doubt[h] * (part + np.outer(apart, apart))
        return doubt

    def _posture(self, belief: Belief, P: Array, explained: Explained, h: int, found: Array) -> tuple[Array, Array]:
        """Return the (22,) shift and (22, 22) covariance of the posture if answer `h` is the right one."""
        columns = P[:, _FOUND]
        gain = columns.dot(inverse_spd(columns[9:] + explained.spread[h]))
        shift = -gain.dot(found)
        P = P - gain.dot(columns.T)
        W = explained.W[h]
        m0, m1 = belief.e_from_marker
        # Errors of the posture from those of the poses and of the GH centre in the markers, and from what W leaves open.
        B, M = _FROM_POSES.copy(), _FROM_DRIFT.copy()
        M[ACROMION, TURN[0]], M[ARM, TURN[1]] = -m0, -m1
        B[:, 9:] = M.dot(W)
        mean = M.dot(W.dot(found + shift[9:]))
        mean[POSES] += shift[POSES]
        return mean, B.dot(P).dot(B.T) + M.dot(explained.rest[h]).dot(M.T)

    def _compose(self, belief: Belief, explained: Explained, mean: Array, covariance: Array, weights: Array) -> Posture:
        drift = mean[_BONES:]
        m0, m1 = (R.dot(base.turn.T) for R, base in zip(belief.e_from_marker, belief.base, strict=True))
        p_gh = belief.p_gh + mean[GH]
        e_from_gh = transform(exp_so3(mean[ACROMION]).dot(m0).dot(self._m0_from_gh[:3, :3]), p_gh)
        R_elw = exp_so3(mean[ARM]).dot(m1).dot(self._m1_from_elw[:3, :3])
        e_from_elw = transform(R_elw, p_gh - (explained.length_m + float(drift[LENGTH])) * R_elw[:, 1])
        slides = [base.slide + drift[SLIDE[k]] for k, base in enumerate(belief.base)]
        turns = [_turned(base, drift[TURN[k]]) for k, base in enumerate(belief.base)]
        drifted = [
            1.0 if base.jumped and not _is_back(slides[k], turns[k]) else float(self._answers.of_marker[k].dot(weights))
            for k, base in enumerate(belief.base)
        ]
        return Posture(
            e_from_gh,
            e_from_elw,
            covariance,
            (slides[0], slides[1]),
            (turns[0], turns[1]),
            (drifted[0], drifted[1]),
            float(self._answers.turned.dot(weights)),
        )


def _mixture(weights: Array, parts: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return mean and covariance of a mixture of (mean, covariance)."""
    mean = np.asarray(sum(w * m for w, (m, _) in zip(weights, parts, strict=True)))
    apart = [m - mean for m, _ in parts]
    spread = (w * (part + np.outer(d, d)) for w, (_, part), d in zip(weights, parts, apart, strict=True))
    return mean, np.asarray(sum(spread))


def _is_back(slide: Array, turn: Array) -> bool:
    """Return whether a marker that has jumped is where calibration says, as far as calibration goes."""
    return math.sqrt(float(slide @ slide)) < _BACK_M and math.sqrt(float(turn @ turn)) < _BACK_RAD


def _turned(base: Base, turn: Array) -> Array:
    return log_so3(base.turn @ exp_so3(turn)) if base.jumped else turn
