"""What the service says of itself: counts, ages, lateness recent and of all time, garbage collected between ticks."""

import gc
import weakref

import pytest

from ghest_drivers.samples import DeviceVitals
from ghest_rt.messages.published import InputState
from ghest_rt.service.health import HealthMeter, SampleCounts
from ghest_rt.service.histogram import DurationHistogram, RecentDurations
from ghest_rt.service.inputs import InputCounters
from ghest_rt.service.pacing import Pacer
from ghest_rt.service.process import GarbageRounds, punctual_process


def test_recent_percentiles_forget_what_is_long_past() -> None:
    recent = RecentDurations(capacity=100)
    assert recent.percentiles_us((50.0, 100.0)) == (0.0, 0.0)
    recent.add(5_000_000)
    for duration_us in range(1, 100):
        recent.add(duration_us * 1000)
    assert recent.percentiles_us((50.0, 99.0, 100.0)) == (50.0, 99.0, 5000.0)
    recent.add(1000)  # takes the bad one's place
    assert recent.percentiles_us((100.0,)) == (99.0,)


def test_the_histogram_counts_exactly_at_its_edges() -> None:
    histogram = DurationHistogram()
    for duration_us in (1, 16, 16.001, 32, 1000, 10**9):
        histogram.add(round(duration_us * 1000))
    assert histogram.counts_up_to((4, 5, 10, 23)) == (2, 4, 5, 5)  # 16 us, 32 us, 1.02 ms, 8.4 s
    assert histogram.sum_us == pytest.approx(1 + 16 + 16.001 + 32 + 1000 + 10**9)


def test_health_tells_rates_ages_and_what_devices_say_of_themselves() -> None:
    counters = InputCounters(state=InputState.STREAMING)
    pacer = Pacer(lambda: 0, lambda t_ns: t_ns, lambda k, t_ns: None)
    meter = HealthMeter(
        10**9,
        SampleCounts(),
        pacer,
        {"r0": counters},
        vitals=lambda name: DeviceVitals({"bad_checksum": 3, "overrun": 0}, 41.5),
        unused=lambda: {"encoders_repeated": 2},
    )
    for k in range(60):
        counters.count(k, 10**9 + k * 16_000_000)
    for lateness_us in range(1, 101):
        pacer.lateness.add(lateness_us * 1000)
        pacer.recent.add(lateness_us * 1000)
    message = meter.measure(0, 2 * 10**9, 0)
    camera = message.inputs["r0"]
    assert camera.rate_hz == pytest.approx(60.0)
    assert camera.age_ms == pytest.approx(1000.0 - 59 * 16.0)
    assert camera.refused == {"bad_checksum": 3}
    assert camera.temperature_c == 41.5
    assert message.unused == {"encoders_repeated": 2}
    assert message.lateness_recent is not None
    assert message.lateness_recent.p99_us == 99.0
    assert message.lateness_histogram is not None
    assert message.lateness_histogram.count == 100
    assert list(message.lateness_histogram.ticks) == sorted(message.lateness_histogram.ticks)
    assert message.threads >= 1
    assert message.open_files >= 3


class _Loop:
    """Garbage that only a full collection finds once it is old."""


def test_garbage_is_collected_in_rounds_only_and_old_garbage_too() -> None:
    rounds = GarbageRounds(lambda: 0)
    rounds.collect()  # the interpreter collects by itself: nothing to do
    with punctual_process():
        item = _Loop()
        item.me = item  # type: ignore[attr-defined]
        gc.collect()  # old now
        gone = weakref.ref(item)
        del item
        for _ in range(9):
            rounds.collect()
        assert gone() is not None
        frozen = gc.get_freeze_count()
        rounds.collect()
        assert gone() is None
        assert gc.get_freeze_count() > frozen
