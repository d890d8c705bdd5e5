"""Ticks on an absolute grid. A slot that was missed is skipped and counted, never caught up in a burst."""

from collections.abc import Callable

from ghest_rt.service.alarm import Alarm
from ghest_rt.service.histogram import DurationHistogram, RecentDurations
from ghest_rt.sync.grid import Grid


class Pacer:
    """Calls `on_tick(k, t_k)` once in every slot that the machine finds time for.

    When woken late by more than a period, the newest slot due is served and those before it are counted as missed: after any
    stall at most one tick comes off its time, and the next is on the grid again. All times are on the given clock; the
    alarm works on CLOCK_MONOTONIC, `monotonic_of` translates.
    """

    def __init__(
        self,
        now_ns: Callable[[], int],
        monotonic_of: Callable[[int], int],
        on_tick: Callable[[int, int], None],
    ) -> None:
        self._now_ns = now_ns
        self._monotonic_of = monotonic_of
        self._on_tick = on_tick
        self._alarm: Alarm | None = None
        self._grid: Grid | None = None
        self._next = 0
        self.lateness = DurationHistogram()
        self.recent = RecentDurations()
        self.missed = 0
        self.ticks = 0

    def start(self, grid: Grid, alarm: Alarm, first: int = 0) -> None:
        """Begin with slot `first`, or move to another grid."""
        self._grid, self._alarm, self._next = grid, alarm, first
        self._arm()

    def stop(self) -> None:
        """Serve no more slots."""
        self._grid = None

    def wake(self) -> None:
        """Serve the slot that is due, if any; for the alarm to call."""
        if self._grid is None:
            return
        now_ns = self._now_ns()
        due = self._grid.index_from(now_ns + 1) - 1
        if due >= self._next:
            t_ns = self._grid.at(due)
            self.missed += due - self._next
            self.ticks += 1
            self.lateness.add(now_ns - t_ns)
            self.recent.add(now_ns - t_ns)
            self._next = due + 1
            self._on_tick(due, t_ns)
        self._arm()

    def _arm(self) -> None:
        if self._grid is not None and self._alarm is not None:
            self._alarm.arm(self._monotonic_of(self._grid.at(self._next)))
