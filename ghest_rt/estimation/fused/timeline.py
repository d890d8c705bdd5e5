"""Sightings in the order of capture, whatever the order of arrival: the filter is wound back for one that comes late."""

from collections import Counter, deque
from dataclasses import dataclass

from ghest_rt.estimation.fused.belief import Belief
from ghest_rt.estimation.fused.filter import FusedFilter, Outcome
from ghest_rt.estimation.fused.sighting import Sighting

_MARKERS = ("m0", "m1")
# How far back, in sightings, the filter can be wound.
_DEPTH = 16


@dataclass(frozen=True, slots=True, eq=False)
class _Entry:
    """A sighting, what was believed before it, and what became of it."""

    sighting: Sighting
    before: Belief
    outcome: Outcome


class Timeline:
    """The belief after every sighting so far, each taken in at its own capture time.

    Attributes:
        counts: How many sightings were not plainly taken, by marker and reason.
        mistaken: Whether sightings say that the start was wrong.
    """

    def __init__(self, fused: FusedFilter, start: Belief, counts: Counter[str]) -> None:
        """Go on from a belief and from counts."""
        self._filter = fused
        self._belief = start
        self._entries: deque[_Entry] = deque(maxlen=_DEPTH)
        self.counts = counts
        self.mistaken = False

    @property
    def newest(self) -> Belief:
        """What is believed after the newest sighting; copy it before moving it on."""
        return self._belief

    def belief_at(self, t_ns: int) -> Belief | None:
        """Return what was believed after the last sighting not later than `t_ns`; copy it before moving it on.

        None before all that is remembered.
        """
        if self._belief.t_ns <= t_ns:
            return self._belief
        return next((entry.before for entry in reversed(self._entries) if entry.before.t_ns <= t_ns), None)

    def add(self, sighting: Sighting) -> None:
        """Take a sighting in; one older than the filter can be wound back is counted and left aside."""
        later: list[Sighting] = []
        entries = self._entries
        if sighting.t_ns < (entries[0].before if entries else self._belief).t_ns:
            self.counts[f"{_MARKERS[sighting.marker]}_too_late"] += 1
            return
        while entries and entries[-1].sighting.t_ns > sighting.t_ns:
            entry = entries.pop()
            later.append(entry.sighting)
            self._count(entry.sighting, entry.outcome, -1)
            self._belief = entry.before
        self._take(sighting)
        for undone in reversed(later):
            self._take(undone)

    def _take(self, sighting: Sighting) -> None:
        before = self._belief
        self._belief = before.copy()
        outcome = self._filter.take(self._belief, sighting)
        self._entries.append(_Entry(sighting, before, outcome))
        self.mistaken = self.mistaken or outcome is Outcome.MISTAKEN
        self._count(sighting, outcome, 1)

    def _count(self, sighting: Sighting, outcome: Outcome, by: int) -> None:
        if outcome is not Outcome.TAKEN:
            self.counts[f"{_MARKERS[sighting.marker]}_{outcome}"] += by
