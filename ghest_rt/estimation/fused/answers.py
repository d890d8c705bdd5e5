"""The thirty-six answers to what the markers have done on their bones; section 6 of docs/fused-estimator.md."""

import itertools
from dataclasses import dataclass

import numpy as np

from ghest_rt.estimation.fused.belief import Base, Belief
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.so3 import Array, skew

# The drift of both markers and the arm length, in this order.
SLIDE = (slice(0, 3), slice(6, 9))
TURN = (slice(3, 6), slice(9, 12))
LENGTH = 12
DRIFT_SIZE = 13
# What is found, and explained by drift: the GH centre in m0 and in m1; m1's turn about the arm by the forearm (1); the elbow's
# place against the beginning (3), and that of the beginning against calibration (3).
ROWS = 13
TWIST, ELBOW, FIRST_ELBOW = slice(6, 7), slice(7, 10), slice(10, 13)
# What m1 did: it is so from the beginning of the session, or since then.
_EVER, _SINCE = 1, 2
# Keeps the rows regular in answers that say nothing about them.
_REGULAR = np.diag(np.repeat((0.0, 1e-14), (6, ROWS - 6)))
# A cuff lies around the arm: it slides along it, and so far across it, but for this share.
_MOST_ACROSS_M, _SOFTNESS = 0.03, 0.1
# The arm length is taken anew into the geometry when it has changed by this much.
_LENGTH_STEP_M = 0.004


@dataclass(frozen=True, slots=True, eq=False)
class Explained:
    """What the answers expect.

    Attributes:
        base: The jumps it was made for.
        length_m: The arm length it was made for.
        expected: (6,) GH centre in m0 and in m1 if nothing has drifted.
        test: (36, 13, 13) how far from there what is found may be, for weighing the answers.
        spread: (36, 13, 13) the same for making use of them.
        W: (36, 13, 13) drift from what is found to deviate.
        rest: (36, 13, 13) covariance of the drift that this leaves.
        m1_slide: (36, 3, 13) covariance of m1's slide and what is found.
    """

    base: tuple[Base, Base]
    length_m: float
    expected: Array
    test: Array
    spread: Array
    W: Array
    rest: Array
    m1_slide: Array


class Answers:
    """Slide or not, turn or not, of m0; none, from the beginning, or since, of m1: every combination.

    Attributes:
        ever: (36,) whether m1 has done something from the beginning.
        came: (36,) whether it has since.
        m1_moved: (36,) whether it has at all.
        of_marker: (36,) of m0 and of m1: 1.0 where the marker has moved.
        turned: (36,) 1.0 where m1 has been turned from the beginning.
        cost: (36,) twice the logarithm of the odds against it.
        leniency: (36,) taken off that for the covariance: one turn of either marker, not both, is what is doubted.
    """

    def __init__(self, tuning: Tuning, m0_from_gh: Array, m1_from_elw: Array, arm_length_m: float | None) -> None:
        """Prepare the answers.

        Args:
            tuning: Priors.
            m0_from_gh: (4, 4) GH joint frame in the m0 frame, equation (8).
            m1_from_elw: (4, 4) elbow frame in the m1 frame, equation (9).
            arm_length_m: From elbow to GH centre, where calibrated.
        """
        self._gh_in_m0, self._elbow_in_m1, self._along = m0_from_gh[:3, 3], m1_from_elw[:3, 3], m1_from_elw[:3, 1]
        self._arm_length_m = arm_length_m
        kinds = np.array(list(itertools.product((0, 1), (0, 1), (0, 1, 2), (0, 1, 2))))
        self._moved = kinds > 0
        self._since = kinds == _SINCE
        self.ever = (kinds[:, 2:] == _EVER).any(axis=1)
        self.came = self._since.any(axis=1)
        self.m1_moved = self._moved[:, 2:].any(axis=1)
        self.of_marker = [self._moved[:, part].any(axis=1).astype(float) for part in (slice(0, 2), slice(2, 4))]
        self.turned = (kinds[:, 3] == _EVER).astype(float)
        self.cost = self._moved @ np.array([tuning.slide_cost, tuning.turn_cost[0], tuning.slide_cost, tuning.turn_cost[1]])
        only_one = self._moved[:, 1] ^ self._moved[:, 3]
        self.leniency = only_one * (self._moved[:, (1, 3)] @ np.array(tuning.turn_doubt))
        length = tuning.unknown_arm_length_m if arm_length_m is None else tuning.arm_length_m
        slides = [np.array(tuning.slide_m) ** 2, np.full(2, tuning.calibrated_m**2), np.full(2, tuning.exact_m**2)]
        turns = [np.array(tuning.turn_rad) ** 2, np.full(2, tuning.calibrated_rad**2), np.full(2, tuning.exact_rad**2)]
        moved, tolerance, exact = (
            np.concatenate((np.repeat(np.column_stack((s, t)).ravel(), 3), (length**2,)))
            for s, t in zip(slides, turns, strict=True)
        )
        spread = np.concatenate((np.repeat(self._moved, 3, axis=1), np.ones((len(kinds), 1), dtype=bool)), axis=1)
        self._test = np.where(spread, moved, tolerance)
        self._prior = np.where(spread, moved, exact)
        self._explained: Explained | None = None

    def explained(self, belief: Belief) -> Explained:
        """Return what each answer expects; kept while arm length and jumps stay as they are."""
        length = self._arm_length_m
        if length is None:
            base = belief.base[1]
            length = float(self._along.dot(base.slide + base.turn.dot(belief.gh_in_marker[1]) - self._elbow_in_m1))
        known = self._explained
        if known is None or known.base is not belief.base or abs(known.length_m - length) > _LENGTH_STEP_M:
            known = self._explained = self._explain(belief, length)
        return known

    def implausible(self, explained: Explained, P: Array, found: Array) -> Array:
        """Return (36,) what speaks against the answers because m1 would have slid farther across the arm than a cuff can.

        Args:
            explained: What the answers expect.
            P: (13, 13) covariance of what is found.
            found: (13,) what is found, against what is expected if nothing has drifted.
        """
        slide = explained.base[1].slide + np.einsum("hij,hj->hi", explained.m1_slide, solved(P + explained.spread, found))
        across = slide - (slide @ self._along)[:, None] * self._along
        beyond = np.sqrt(np.square(across).sum(axis=1)) / _MOST_ACROSS_M - 1.0
        return np.asarray(np.square(np.maximum(beyond, 0.0) / _SOFTNESS))

    def _explain(self, belief: Belief, length_m: float) -> Explained:
        nominal = (self._gh_in_m0, self._elbow_in_m1 + length_m * self._along)
        G = np.zeros((ROWS, DRIFT_SIZE))
        expected = np.empty(6)
        variance = np.zeros(DRIFT_SIZE)
        for k, base in enumerate(belief.base):
            rows = slice(3 * k, 3 * k + 3)
            there = base.turn.T @ (nominal[k] - base.slide)
            expected[rows] = there
            G[rows, SLIDE[k]] = -base.turn.T
            G[rows, TURN[k]] = skew(there)
            variance[SLIDE[k]], variance[TURN[k]] = base.slide_variance, base.turn_variance
        base = belief.base[1]
        G[3:6, LENGTH] = base.turn.T @ self._along
        all_G = np.repeat(G[None], len(self._moved), axis=0)
        # The elbow as m1 shows it: displaced with the marker, and turned about its centre.
        turned_elbow = -skew(self._elbow_in_m1 - base.slide) @ base.turn
        for rows, then in ((ELBOW, self._since), (FIRST_ELBOW, self._moved & ~self._since)):
            all_G[:, rows, SLIDE[1]] = then[:, 2, None, None] * np.eye(3)
            all_G[:, rows, TURN[1]] = then[:, 3, None, None] * turned_elbow
        # The forearm tells what was there from the beginning; what has come since, AxialJudge does.
        all_G[:, TWIST, TURN[1]] = ~self._since[:, 3, None, None] * (self._along @ base.turn)
        test, prior = self._test + variance, self._prior + variance
        weighted = all_G * prior[:, None, :]
        spread = weighted @ np.swapaxes(all_G, 1, 2) + _REGULAR
        W = np.swapaxes(np.linalg.solve(spread, weighted), 1, 2)
        rest = np.einsum("hj,jk->hjk", prior, np.eye(DRIFT_SIZE)) - W @ weighted
        tested = (all_G * test[:, None, :]) @ np.swapaxes(all_G, 1, 2)
        m1_slide = np.swapaxes(weighted[:, :, SLIDE[1]], 1, 2)
        return Explained(belief.base, length_m, expected, tested, spread, W, rest, m1_slide)


def solved(S: Array, found: Array) -> Array:
    """Return (h, n) S^-1 found for (h, n, n) matrices and what is found, (n,)."""
    return np.asarray(np.linalg.solve(S, np.broadcast_to(found[:, None], (len(S), len(found), 1)))[:, :, 0])
