"""Has a marker moved on its bone? Thirty-six answers weighed against each other; section 6 of docs/fused-estimator.md."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from ghest_rt.estimation.fused.belief import ACROMION, ARM, GH, POSES, Base, Belief
from ghest_rt.estimation.fused.reference import NO_EVIDENCE, Evidence
from ghest_rt.estimation.fused.tuning import Tuning
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, exp_so3, log_so3, skew

# The drift of both markers and the arm length, in this order.
SLIDE = (slice(0, 3), slice(6, 9))
TURN = (slice(3, 6), slice(9, 12))
LENGTH = 12
DRIFT_SIZE = 13
# What a posture consists of: scapula, GH centre, humerus, drift.
_POSTURE = 9
# What a posture depends on: of the belief's error states the poses, and the GH centre in the markers; then m1's turn about
# the arm by the forearm (1), the elbow's place against the beginning (3), and that of the beginning against calibration (3).
_KNOWN = 22
_FOUND = slice(9, _KNOWN)
_ROWS = _KNOWN - 9
_TOLD = slice(15, _KNOWN)
_TWIST, _ELBOW, _FIRST_ELBOW = slice(6, 7), slice(7, 10), slice(10, 13)
# Whether a marker has moved is told by these; the rest says what it did.
_WHETHER = 7
# What m1 did: it is so from the beginning of the session, or since then.
_EVER, _SINCE = 1, 2
# Evidence (twice a logarithm) that counts as clear when an answer is held against what was seen earlier.
_CLEAR = 10.0
# Keeps the rows regular in answers that say nothing about them.
_REGULAR = np.diag(np.repeat((0.0, 1e-14), (6, _ROWS - 6)))
# Variance of what is not known, m^2 and rad^2.
_ANYTHING = 1e2
_FROM_POSES = np.eye(_POSTURE + DRIFT_SIZE, _KNOWN)
_FROM_DRIFT = np.eye(_POSTURE + DRIFT_SIZE, DRIFT_SIZE, -_POSTURE)
# An answer this unlikely is left out.
_NEGLIGIBLE = 2e-2
# A turn that is likelier than this counts in the covariance, even if it is not taken out.
_DOUBTFUL = 1e-2
# The answers are weighed this often.
_WEIGH_NS = 150_000_000
# A marker that has jumped is back if it is within this of where it was.
_BACK_M, _BACK_RAD = 0.003, math.radians(1.0)
# The arm length is taken anew into the geometry when it has changed by this much.
_LENGTH_STEP_M = 0.004


@dataclass(frozen=True, slots=True, eq=False)
class Posture:
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
        """Prepare the answers.

        Args:
            tuning: Priors.
            m0_from_gh: (4, 4) GH joint frame in the m0 frame, equation (8).
            m1_from_elw: (4, 4) elbow frame in the m1 frame, equation (9).
            arm_length_m: From elbow to GH centre, where calibrated.
        """
        self._m0_from_gh = m0_from_gh
        self._m1_from_elw = m1_from_elw
        self._arm_length_m = arm_length_m
        # Slide and turn of m0; of m1: none, from the beginning, or since.
        kinds = np.array(list(itertools.product((0, 1), (0, 1), (0, 1, 2), (0, 1, 2))))
        self._moved = kinds > 0
        self._since = kinds == _SINCE
        self._turned = (kinds[:, 3] == _EVER).astype(float)
        self._of_marker = [self._moved[:, part].any(axis=1).astype(float) for part in (slice(0, 2), slice(2, 4))]
        self._ever = (kinds[:, 2:] == _EVER).any(axis=1)
        self._came = self._since.any(axis=1)
        self._m1_moved = self._moved[:, 2:].any(axis=1)
        self._cost = self._moved @ np.array([tuning.slide_cost, tuning.turn_cost[0], tuning.slide_cost, tuning.turn_cost[1]])
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
        self._explained: _Explained | None = None
        self._weighed: _Explained | None = None
        self._weighed_ns = 0
        self._weights = np.zeros(len(kinds))
        # One turn of each marker, not both, is what is doubted.
        self._leniency = tuning.turn_doubt * (self._moved[:, 1] ^ self._moved[:, 3])
        self._doubts = np.zeros(len(kinds))
        self._doubt = np.zeros((_POSTURE + DRIFT_SIZE, _POSTURE + DRIFT_SIZE))
        self._doubted_ns = -1
        self._against = np.zeros(len(kinds))

    def judge(
        self,
        belief: Belief,
        elbow_moved: Array | None = None,
        elbow_m2: float = 0.0,
        evidence: Evidence = NO_EVIDENCE,
    ) -> Posture:
        """Return the bones as the mean over the answers, with the covariance of the mixture.

        Args:
            belief: The belief.
            elbow_moved: (3,) how far the elbow, as m1 shows it, has moved in camera r1 since the beginning; axes of m1 as
                calibrated, m. None if that is not known.
            elbow_m2: Variance of that per axis without any drift.
            evidence: What differs from the calibration session.
        """
        explained = self._explanations(belief)
        found = np.zeros(_ROWS)
        found[:3], found[3:6] = belief.gh_in_marker
        found[:6] -= explained.expected
        variance = np.full(_ROWS - 6, _ANYTHING)
        for rows, value, known in (
            (_TWIST, evidence.twist_rad, evidence.twist_rad2),
            (_ELBOW, elbow_moved, elbow_m2),
            (_FIRST_ELBOW, evidence.elbow, evidence.elbow_m2),
        ):
            if value is not None:
                found[rows] = value
                variance[rows.start - 6 : rows.stop - 6] = known
        P = np.zeros((_KNOWN, _KNOWN))
        P[:15, :15] = belief.P[:15, :15]
        P[_TOLD, _TOLD] = np.diag(variance)
        weights = self._weigh(belief.t_ns, P[_FOUND, _FOUND], explained, found, elbow_known=elbow_moved is not None)
        kept = np.flatnonzero(weights)
        postures = [self._posture(belief, P, explained, int(h), found) for h in kept]
        mean, covariance = postures[0] if len(postures) == 1 else _mixture(weights[kept], postures)
        covariance = covariance + self._doubt_of(belief, P, explained, found, mean)
        return self._compose(belief, explained, mean, covariance, weights)

    def _doubt_of(self, belief: Belief, P: Array, explained: "_Explained", found: Array, mean: Array) -> Array:
        """Return the (22, 22) variance about the mean of turns that are too unlikely to be taken out, and too likely to ignore.

        Nothing rules out a small turn that leaves the GH centre where it is. Asked for as often as the answers are weighed.
        """
        if self._doubted_ns != self._weighed_ns:
            self._doubted_ns = self._weighed_ns
            self._doubt = np.zeros((_POSTURE + DRIFT_SIZE, _POSTURE + DRIFT_SIZE))
            for h in np.flatnonzero((self._doubts > _DOUBTFUL) & (self._weights == 0.0)):
                shift, part = self._posture(belief, P, explained, int(h), found)
                apart = shift - mean
                self._doubt += self._doubts[h] * (part + np.outer(apart, apart))
        return self._doubt

    def _weigh(self, t_ns: int, P: Array, explained: "_Explained", found: Array, *, elbow_known: bool) -> Array:
        """Return the (36,) probabilities of the answers; drift is slow, they are asked for anew only now and then."""
        if self._weighed is explained and 0 <= t_ns - self._weighed_ns < _WEIGH_NS:
            return self._weights
        S = P + explained.test
        evidence = _evidence(S, found)
        # What has been there from the beginning cannot have been missing before, nor what has come since have been there.
        if elbow_known:
            self._against[self._ever] = np.maximum(self._against, evidence - evidence[0] - _CLEAR)[self._ever]
        else:
            self._against[self._came] = max(float(evidence[0] - evidence.min()) - _CLEAR, 0.0)
        cost = evidence + self._cost + self._against
        if not elbow_known:
            cost[self._came] = np.inf
        if elbow_known:
            # The elbow tells what has happened to m1, not whether: alone, it has only moved beside the exoskeleton's.
            markers = _evidence(S[:, :_WHETHER, :_WHETHER], found[:_WHETHER]) + self._cost + self._against
            cost[self._m1_moved] += _total(markers[self._m1_moved]) - _total(cost[self._m1_moved])
            cost[~self._m1_moved] = markers[~self._m1_moved]
        honest = cost - self._leniency
        doubts = np.exp(-0.5 * (honest - honest.min()))
        self._doubts = doubts / doubts.sum()
        odds = np.exp(-0.5 * (cost - cost.min()))
        odds[odds < _NEGLIGIBLE] = 0.0
        self._weights = odds / odds.sum()
        self._weighed, self._weighed_ns = explained, t_ns
        return self._weights

    def _explanations(self, belief: Belief) -> "_Explained":
        """Return what each answer expects of the GH centre in the markers; kept while arm length and jumps stay as they are."""
        R, c = self._m1_from_elw[:3, :3], self._m1_from_elw[:3, 3]
        along = R[:, 1]
        length = self._arm_length_m
        if length is None:
            length = float(along @ (belief.base[1].slide + belief.base[1].turn @ belief.gh_in_marker[1] - c))
        known = self._explained
        if known is None or known.base is not belief.base or abs(known.length_m - length) > _LENGTH_STEP_M:
            known = self._explain(belief, length)
            self._explained = known
        return known

    def _explain(self, belief: Belief, length_m: float) -> "_Explained":
        along = self._m1_from_elw[:3, 1]
        nominal = (self._m0_from_gh[:3, 3], self._m1_from_elw[:3, 3] + length_m * along)
        G = np.zeros((_ROWS, DRIFT_SIZE))
        expected = np.empty(6)
        variance = np.zeros(DRIFT_SIZE)
        for k, base in enumerate(belief.base):
            rows = slice(3 * k, 3 * k + 3)
            there = base.turn.T @ (nominal[k] - base.slide)
            expected[rows] = there
            G[rows, SLIDE[k]] = -base.turn.T
            G[rows, TURN[k]] = skew(there)
            variance[SLIDE[k]], variance[TURN[k]] = base.slide_variance, base.turn_variance
        G[3:6, LENGTH] = belief.base[1].turn.T @ along
        all_G = np.repeat(G[None], len(self._moved), axis=0)
        # The elbow as m1 shows it: displaced with the marker, and turned about its centre.
        base = belief.base[1]
        turned_elbow = -skew(self._m1_from_elw[:3, 3] - base.slide) @ base.turn
        for rows, then in ((_ELBOW, self._since), (_FIRST_ELBOW, self._moved & ~self._since)):
            all_G[:, rows, SLIDE[1]] = then[:, 2, None, None] * np.eye(3)
            all_G[:, rows, TURN[1]] = then[:, 3, None, None] * turned_elbow
        # The forearm tells what was there from the beginning; what has come since, AxialJudge does.
        all_G[:, _TWIST, TURN[1]] = ~self._since[:, 3, None, None] * (along @ base.turn)
        test, prior = self._test + variance, self._prior + variance
        weighted = all_G * prior[:, None, :]
        spread = weighted @ np.swapaxes(all_G, 1, 2) + _REGULAR
        W = np.swapaxes(np.linalg.solve(spread, weighted), 1, 2)
        rest = np.einsum("hj,jk->hjk", prior, np.eye(DRIFT_SIZE)) - W @ weighted
        tested = (all_G * test[:, None, :]) @ np.swapaxes(all_G, 1, 2)
        return _Explained(belief.base, length_m, expected, tested, spread, W, rest)

    def _posture(self, belief: Belief, P: Array, explained: "_Explained", h: int, found: Array) -> tuple[Array, Array]:
        """Return the (22,) shift and (22, 22) covariance of the posture if answer `h` is the right one."""
        columns = P[:, _FOUND]
        gain = np.linalg.solve(columns[9:] + explained.spread[h], columns.T).T
        shift = -(gain @ found)
        P = P - gain @ columns.T
        W = explained.W[h]
        m0, m1 = belief.e_from_marker
        # Errors of the posture from those of the poses and of the GH centre in the markers, and from what W leaves open.
        B, M = _FROM_POSES.copy(), _FROM_DRIFT.copy()
        M[ACROMION, TURN[0]], M[ARM, TURN[1]] = -m0, -m1
        B[:, 9:] = M @ W
        drift = W @ (found + shift[9:])
        mean = M @ drift
        mean[POSES] += shift[POSES]
        return mean, B @ P @ B.T + M @ explained.rest[h] @ M.T

    def _compose(self, belief: Belief, explained: "_Explained", mean: Array, covariance: Array, weights: Array) -> Posture:
        drift = mean[_POSTURE:]
        m0, m1 = (R @ base.turn.T for R, base in zip(belief.e_from_marker, belief.base, strict=True))
        p_gh = belief.p_gh + mean[GH]
        e_from_gh = transform(exp_so3(mean[ACROMION]) @ m0 @ self._m0_from_gh[:3, :3], p_gh)
        R_elw = exp_so3(mean[ARM]) @ m1 @ self._m1_from_elw[:3, :3]
        e_from_elw = transform(R_elw, p_gh - (explained.length_m + float(drift[LENGTH])) * R_elw[:, 1])
        slides = [base.slide + drift[SLIDE[k]] for k, base in enumerate(belief.base)]
        turns = [_turned(base, drift[TURN[k]]) for k, base in enumerate(belief.base)]
        drifted = [
            1.0 if base.jumped and not _is_back(slides[k], turns[k]) else float(self._of_marker[k] @ weights)
            for k, base in enumerate(belief.base)
        ]
        return Posture(
            e_from_gh,
            e_from_elw,
            covariance,
            (slides[0], slides[1]),
            (turns[0], turns[1]),
            (drifted[0], drifted[1]),
            float(self._turned @ weights),
        )


def _evidence(S: Array, found: Array) -> Array:
    """Return -2 log N(found; 0, S) of each of the (h, n, n) covariances, but for a constant."""
    solved = np.linalg.solve(S, np.broadcast_to(found[:, None], (len(S), len(found), 1)))[:, :, 0]
    return np.asarray(solved @ found + np.linalg.slogdet(S)[1])


def _mixture(weights: Array, parts: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return mean and covariance of a mixture of (mean, covariance)."""
    mean = np.asarray(sum(w * m for w, (m, _) in zip(weights, parts, strict=True)))
    apart = [m - mean for m, _ in parts]
    spread = (w * (part + np.outer(d, d)) for w, (_, part), d in zip(weights, parts, apart, strict=True))
    return mean, np.asarray(sum(spread))


def _total(cost: Array) -> float:
    """Return the cost of any of these answers being right."""
    least = float(cost.min())
    return least - 2.0 * float(np.log(np.exp(-0.5 * (cost - least)).sum()))


def _is_back(slide: Array, turn: Array) -> bool:
    """Return whether a marker that has jumped is where calibration says, as far as calibration goes."""
    return math.sqrt(float(slide @ slide)) < _BACK_M and math.sqrt(float(turn @ turn)) < _BACK_RAD


def _turned(base: Base, turn: Array) -> Array:
    return log_so3(base.turn @ exp_so3(turn)) if base.jumped else turn


@dataclass(frozen=True, slots=True, eq=False)
class _Explained:
    """What the answers expect.

    Attributes:
        base: The jumps it was made for.
        length_m: The arm length it was made for.
        expected: (6,) GH centre in m0 and in m1 if nothing has drifted.
        test: (36, n, n) how far from there it may be found, for weighing the answers.
        spread: (36, n, n) the same for making use of them.
        W: (36, 13, n) drift from what is found to deviate.
        rest: (36, 13, 13) covariance of the drift that this leaves.
    """

    base: object
    length_m: float
    expected: Array
    test: Array
    spread: Array
    W: Array
    rest: Array
