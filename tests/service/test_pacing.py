"""Ticks: skipped and counted, never in a burst."""

import asyncio

import pytest

from ghest_rt.service.alarm import LoopAlarm, TimerfdAlarm
from ghest_rt.service.clocks import ScaledClock
from ghest_rt.service.histogram import DurationHistogram
from ghest_rt.service.pacing import Pacer
from ghest_rt.sync.grid import Grid

PERIOD_NS = 10_000_000


class ScriptedAlarm:
    def __init__(self) -> None:
        self.armed_ns: list[int] = []

    def arm(self, t_monotonic_ns: int) -> None:
        self.armed_ns.append(t_monotonic_ns)

    def close(self) -> None:
        pass


class Rig:
    """A pacer at 100 Hz on a clock that the test sets."""

    def __init__(self) -> None:
        self.now_ns = 0
        self.ticks: list[tuple[int, int]] = []
        self.busy_ns = 0
        self.alarm = ScriptedAlarm()
        self.pacer = Pacer(lambda: self.now_ns, lambda t_ns: t_ns, self._tick)
        self.pacer.start(Grid(0, 100.0), self.alarm)

    def _tick(self, k: int, t_ns: int) -> None:
        self.ticks.append((k, t_ns))
        self.now_ns += self.busy_ns

    def wake_at(self, t_ns: int) -> None:
        self.now_ns = t_ns
        self.pacer.wake()


def test_every_slot_is_served_once_on_a_quiet_machine() -> None:
    rig = Rig()
    for k in range(5):
        rig.wake_at(k * PERIOD_NS + 1000)
    assert rig.ticks == [(k, k * PERIOD_NS) for k in range(5)]
    assert rig.pacer.missed == 0
    assert rig.alarm.armed_ns == [k * PERIOD_NS for k in range(6)]


def test_an_early_wake_up_serves_nothing_and_waits_on() -> None:
    rig = Rig()
    rig.wake_at(0)
    rig.wake_at(PERIOD_NS - 1)
    assert rig.ticks == [(0, 0)]
    assert rig.alarm.armed_ns[-1] == PERIOD_NS


def test_missed_slots_are_counted_and_never_caught_up() -> None:
    rig = Rig()
    rig.wake_at(0)
    rig.wake_at(4 * PERIOD_NS + 3_000_000)  # slots 1, 2, 3 went by
    assert rig.ticks == [(0, 0), (4, 4 * PERIOD_NS)]
    assert rig.pacer.missed == 3
    rig.wake_at(rig.now_ns)  # nothing more is due before slot 5
    assert len(rig.ticks) == 2
    assert rig.alarm.armed_ns[-1] == 5 * PERIOD_NS


def test_a_tick_that_outlasts_its_period_costs_slots_but_keeps_the_grid() -> None:
    rig = Rig()
    rig.busy_ns = 25_000_000
    for _ in range(4):
        rig.wake_at(max(rig.now_ns, rig.alarm.armed_ns[-1]))
    assert [t_ns % PERIOD_NS for _, t_ns in rig.ticks] == [0, 0, 0, 0]
    assert [k for k, _ in rig.ticks] == [0, 2, 5, 7]
    assert rig.pacer.missed == 4


def test_moving_to_another_grid_within_a_tick() -> None:
    rig = Rig()
    rig.wake_at(0)
    rig.pacer.start(Grid(5_500_000, 100.0), rig.alarm)
    rig.wake_at(5_500_000)
    rig.wake_at(15_500_000)
    assert [t_ns for _, t_ns in rig.ticks] == [0, 5_500_000, 15_500_000]


def test_a_stopped_pacer_serves_nothing() -> None:
    rig = Rig()
    rig.pacer.stop()
    rig.wake_at(PERIOD_NS)
    assert rig.ticks == []


@pytest.mark.parametrize("kind", [TimerfdAlarm, LoopAlarm])
async def test_alarms_fire_after_their_instant_and_not_after_close(kind: type[TimerfdAlarm] | type[LoopAlarm]) -> None:
    clock = ScaledClock()
    fired: asyncio.Queue[int] = asyncio.Queue()
    alarm = kind(asyncio.get_running_loop(), lambda: fired.put_nowait(clock.now_ns()))
    for delay_ns in (2_000_000, -1_000_000_000, 1_000_000):
        due_ns = clock.now_ns() + delay_ns
        alarm.arm(due_ns)
        async with asyncio.timeout(5.0):
            assert await fired.get() >= due_ns
    alarm.arm(clock.now_ns() + 1_000_000)
    alarm.close()
    await asyncio.sleep(0.01)
    assert fired.empty()


def test_a_scaled_clock_runs_at_its_speed_and_finds_host_time() -> None:
    clock = ScaledClock(speed=4.0)
    t_ns = clock.now_ns()
    ahead_ns = clock.monotonic_of(t_ns + 4_000_000) - clock.monotonic_of(t_ns)
    assert abs(ahead_ns - 1_000_000) <= 1
    clock.sleep_until_ns(t_ns + 8_000_000)
    assert clock.now_ns() >= t_ns + 8_000_000


def test_percentiles_of_known_durations() -> None:
    histogram = DurationHistogram()
    assert histogram.percentile_us(50.0) == 0.0
    for duration_us in range(1, 1001):
        histogram.add(duration_us * 1000)
    assert histogram.percentile_us(50.0) == pytest.approx(500.0, rel=0.05)
    assert histogram.percentile_us(99.0) == pytest.approx(990.0, rel=0.05)
    assert histogram.max_us == 1000.0
    assert histogram.percentile_us(100.0) == 1000.0


def test_durations_out_of_the_histograms_range_are_kept() -> None:
    histogram = DurationHistogram()
    histogram.add(-5)
    histogram.add(10**12)
    assert histogram.count == 2
    assert histogram.max_us == 1e9
    assert histogram.percentile_us(50.0) <= 1.0
