"""Device clocks that drift, wrap, step and restart, seen through delays that are never negative and sometimes long."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ghest_drivers.clock_sync import ClockMap, ProbeVerdict, wrap_period_ns

S = 1_000_000_000
MS = 1_000_000


def probes(
    seed: int,
    seconds: float,
    *,
    rate_hz: float = 66.6,
    drift_ppm: float = 80.0,
    offset_ns: int = 7 * S,
    jitter_ns: float = 0.3 * MS,
    stall_share: float = 0.02,
) -> Iterator[tuple[int, int, int]]:
    """Yield (host truth, device time, arrival) of each sample."""
    rng = np.random.default_rng(seed)
    arrival = 0
    for k in range(int(seconds * rate_hz)):
        truth = 100 * S + round(k * S / rate_hz)
        device = round((truth - offset_ns) / (1 + drift_ppm * 1e-6))
        delay = rng.exponential(jitter_ns) + (rng.uniform(5, 40) * MS if rng.random() < stall_share else 0.0)
        arrival = max(arrival, truth + round(delay))
        yield truth, device, arrival


@pytest.mark.parametrize("drift_ppm", [-400.0, 0.0, 80.0, 400.0])
def test_maps_within_a_tenth_of_a_millisecond_in_spite_of_stalls(drift_ppm: float) -> None:
    clock = ClockMap()
    errors = []
    for truth, device, arrival in probes(1, 60.0, drift_ppm=drift_ppm):
        clock.update(device, arrival)
        errors.append(clock.to_host_ns(device) - truth)
    settled = np.array(errors[666:])
    assert np.abs(settled).max() < 0.1 * MS
    assert np.abs(errors[66:]).max() < 1.5 * MS
    assert clock.fit.drift_ppm == pytest.approx(drift_ppm, abs=5.0)
    assert clock.fit.steps == 0


@pytest.mark.parametrize(("bits", "tick_ns"), [(32, 1_000), (16, 1_000_000), (24, 10_000), (10, 1_000_000)])
def test_wraps_of_any_width_do_not_show(bits: int, tick_ns: int) -> None:
    wrap_ns = wrap_period_ns(bits, tick_ns)
    clock = ClockMap(wrap_ns=wrap_ns)
    seconds = min(2.5 * wrap_ns / S, 200.0)
    offset_ns = 100 * S - (wrap_ns - 3 * S)  # wraps three seconds into the run at the latest
    errors = []
    for truth, device, arrival in probes(2, max(seconds, 10.0), offset_ns=offset_ns, jitter_ns=0.1 * MS, stall_share=0.0):
        clock.update(device // tick_ns * tick_ns % wrap_ns, arrival)
        errors.append(clock.to_host_ns(device // tick_ns * tick_ns % wrap_ns) - truth)
    assert np.abs(errors[66:]).max() < 0.4 * MS + tick_ns
    assert clock.fit.steps == 0
    assert clock.fit.suspect == 0


def test_silence_of_several_wraps_is_bridged() -> None:
    wrap_ns = wrap_period_ns(16, 100_000)  # 6.6 s
    clock = ClockMap(wrap_ns=wrap_ns)
    truth = 0
    for truth, device, arrival in probes(3, 10.0, stall_share=0.0):  # noqa: B007
        clock.update(device % wrap_ns, arrival)
    truth += 60 * S
    device = round((truth - 7 * S) / (1 + 80e-6))
    assert clock.update(device % wrap_ns, truth + MS) is ProbeVerdict.USED
    assert clock.to_host_ns(device % wrap_ns) == pytest.approx(truth, abs=2 * MS)


@pytest.mark.parametrize("step_s", [-1000.0, -90.0, -0.2, 0.2, 90.0, 1000.0])
@pytest.mark.parametrize("wrap_ns", [None, wrap_period_ns(32, 1_000)])
def test_a_step_is_refused_until_sure_then_followed(step_s: float, wrap_ns: int | None) -> None:
    clock = ClockMap(wrap_ns=wrap_ns)
    worst, refused, stepped = 0.0, 0, 0
    for index, (truth, device, arrival) in enumerate(probes(4, 20.0, offset_ns=-2000 * S, stall_share=0.0)):
        raw = device + (round(step_s * S) if index > 666 else 0)
        if wrap_ns is not None:
            raw %= wrap_ns
        verdict = clock.update(raw, arrival)
        stepped += verdict is ProbeVerdict.STEPPED
        if verdict is ProbeVerdict.SUSPECT:
            refused += 1
        elif index > 66:
            worst = max(worst, abs(clock.to_host_ns(raw) - truth))
    assert stepped == 1
    assert refused == 4
    assert worst < 2 * MS


def test_one_corrupt_stamp_changes_nothing() -> None:
    clean, struck = ClockMap(), ClockMap()
    for index, (_, device, arrival) in enumerate(probes(5, 10.0)):
        clean.update(device, arrival)
        if index == 300:
            assert struck.stamp(device + 5 * S, arrival) is None
            assert struck.stamp(device - 5 * S, arrival) is None
        struck.update(device, arrival)
        assert struck.to_host_ns(device) == clean.to_host_ns(device)
    assert struck.fit.suspect == 2


def test_a_drained_backlog_keeps_its_true_times() -> None:
    clock = ClockMap()
    feed = list(probes(6, 20.0, stall_share=0.0))
    release_ns = feed[900][0] + 400 * MS
    verdicts = []
    for truth, device, arrival in feed:
        held = max(arrival, release_ns) if feed[900][0] <= truth < release_ns else arrival
        verdicts.append(clock.update(device, held))
        if truth > feed[700][0]:
            assert clock.to_host_ns(device) == pytest.approx(truth, abs=0.2 * MS)
    assert verdicts.count(ProbeVerdict.SLOW) > 10
    assert clock.fit.steps == 0


def test_a_clock_that_stops_for_a_while_is_followed_after_seconds() -> None:
    clock = ClockMap(slow_confirm_s=2.0)
    verdicts = []
    for index, (truth, device, arrival) in enumerate(probes(7, 20.0, stall_share=0.0)):
        raw = device - (300 * MS if index > 666 else 0)
        if 646 < index <= 666:
            continue  # silent while its clock stands still
        verdicts.append(clock.update(raw, arrival))
        if index > 1000:
            assert clock.to_host_ns(raw) == pytest.approx(truth, abs=2 * MS)
    assert verdicts.count(ProbeVerdict.STEPPED) == 1


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32), st.floats(-500, 500), st.sampled_from([None, wrap_period_ns(16, 1_000_000)]))
def test_stamps_increase_and_never_lie_after_arrival(seed: int, drift_ppm: float, wrap_ns: int | None) -> None:
    clock = ClockMap(wrap_ns=wrap_ns)
    last, first = 0, round((100 * S - 7 * S) / (1 + drift_ppm * 1e-6))
    for _, device, arrival in probes(seed, 12.0, drift_ppm=drift_ppm, jitter_ns=1.0 * MS):
        stamp = clock.stamp(device if wrap_ns is None else device % wrap_ns, arrival)
        assert stamp is not None
        assert stamp <= arrival
        if device - first > S:
            assert last < stamp
        last = stamp


def test_latency_is_taken_off() -> None:
    clock = ClockMap(latency_ns=2 * MS)
    assert clock.stamp(0, 10 * MS) == 8 * MS


def test_asking_before_the_first_probe_is_an_error() -> None:
    with pytest.raises(ValueError, match="before the first update"):
        ClockMap().to_host_ns(0)


@pytest.mark.parametrize("arguments", [{"wrap_ns": 0}, {"slew": 0.0}, {"slew": 1.0}])
def test_senseless_settings_are_refused(arguments: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(arguments))):
        ClockMap(**arguments)  # type: ignore[arg-type]
