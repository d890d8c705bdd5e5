"""How likely each answer is, by how well it explains what is found; section 6 of docs/fused-estimator.md."""

import numpy as np

from ghest_rt.estimation.fused.answers import TWIST, Answers, Explained, solved
from ghest_rt.geometry.so3 import Array

# Whether a marker has moved is told by these rows; the rest says what it did.
_WHETHER = TWIST.stop
# Evidence (twice a logarithm) that counts as clear when an answer is held against what was seen earlier.
_CLEAR = 10.0
# An answer this unlikely is left out.
_NEGLIGIBLE = 2e-2
# Drift is slow: the answers are weighed this often.
_WEIGH_NS = 150_000_000


class Weighing:
    """The probabilities of the answers, and what has ever spoken against them.

    Attributes:
        probability: (36,) of the answers that are not negligible; they add up to 1.
        doubt: (36,) the same at lower odds against a turn, for the covariance.
        t_ns: When they were weighed.
    """

    def __init__(self, answers: Answers) -> None:
        """Start without evidence."""
        self._answers = answers
        self._explained: Explained | None = None
        self._against = np.zeros(len(answers.cost))
        self.probability = np.zeros(len(answers.cost))
        self.doubt = np.zeros(len(answers.cost))
        self.t_ns = -1

    def weigh(self, t_ns: int, P: Array, explained: Explained, found: Array, *, elbow_known: bool) -> bool:
        """Weigh the answers anew if it is time to; return whether they have been.

        Args:
            t_ns: The instant.
            P: (13, 13) covariance of what is found.
            explained: What the answers expect.
            found: (13,) what is found, against what is expected if nothing has drifted.
            elbow_known: Whether it is known how the elbow has moved since the beginning.
        """
        if self._explained is explained and 0 <= t_ns - self.t_ns < _WEIGH_NS:
            return False
        answers = self._answers
        S = P + explained.test
        evidence = _evidence(S, found)
        # What has been there from the beginning cannot have been missing before, nor what has come since have been there.
        if elbow_known:
            self._against[answers.ever] = np.maximum(self._against, evidence - evidence[0] - _CLEAR)[answers.ever]
        else:
            self._against[answers.came] = max(float(evidence[0] - evidence.min()) - _CLEAR, 0.0)
        odds_against = answers.cost + self._against + answers.implausible(explained, P, found)
        cost = evidence + odds_against
        if elbow_known:
            # The elbow tells what has happened to m1, not whether: alone, it has only moved beside the exoskeleton's.
            markers = _evidence(S[:, :_WHETHER, :_WHETHER], found[:_WHETHER]) + odds_against
            cost[answers.m1_moved] += _total(markers[answers.m1_moved]) - _total(cost[answers.m1_moved])
            cost[~answers.m1_moved] = markers[~answers.m1_moved]
        else:
            cost[answers.came] = np.inf
        self.doubt = _probability(cost - answers.leniency, 0.0)
        self.probability = _probability(cost, _NEGLIGIBLE)
        self._explained, self.t_ns = explained, t_ns
        return True


def _probability(cost: Array, negligible: float) -> Array:
    odds = np.exp(-0.5 * (cost - cost.min()))
    odds[odds < negligible] = 0.0
    return np.asarray(odds / odds.sum())


def _evidence(S: Array, found: Array) -> Array:
    """Return -2 log N(found; 0, S) of each of the (h, n, n) covariances, but for a constant."""
    return np.asarray(solved(S, found) @ found + np.linalg.slogdet(S)[1])


def _total(cost: Array) -> float:
    """Return the cost of any of these answers being right."""
    least = float(cost.min())
    return least - 2.0 * float(np.log(np.exp(-0.5 * (cost - least)).sum()))
