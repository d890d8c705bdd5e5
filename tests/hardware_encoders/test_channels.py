"""Counts to angles, and what is refused."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ghest_drivers.hardware.encoders.builder import Counting, SampleBuilder
from ghest_drivers.hardware.encoders.channels import AngleConverter, Channel
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection

MS = 1_000_000


def one(channel: Channel, counts: float, t_ns: int = 0) -> float | Rejection:
    result = AngleConverter((channel,)).convert((counts,), t_ns)
    return result if isinstance(result, Rejection) else result[0]


@given(
    st.floats(-1e6, 1e6),
    st.floats(-1e6, 1e6),
    st.floats(1e-7, 1e-2),
    st.sampled_from([1, -1]),
    st.floats(-math.pi, math.pi),
)
def test_formula(counts: float, zero: float, scale: float, sign: int, offset: float) -> None:
    channel = Channel("j", "a", rad_per_count=scale, zero_counts=zero, sign=sign, offset_rad=offset)
    assert one(channel, counts) == pytest.approx(sign * (counts - zero) * scale + offset, abs=1e-8, rel=1e-9)


@given(st.integers(0, 4095), st.integers(0, 4095), st.sampled_from([1, -1]), st.integers(-3, 3))
def test_a_single_turn_encoder_does_not_jump_where_its_counts_wrap(position: int, zero: int, sign: int, turns: int) -> None:
    channel = Channel("j", "a", math.tau / 4096, zero, sign, wrap=True, min_rad=-1.0, max_rad=4.0)
    angle = one(channel, position)
    again = one(channel, position + 4096 * turns)
    wanted = math.remainder(sign * (position - zero) * math.tau / 4096 - 1.5, math.tau) + 1.5
    if -0.999 < wanted < 3.999:
        assert angle == pytest.approx(wanted, abs=1e-9)
        assert again == pytest.approx(wanted, abs=1e-9)
    elif not -1.001 < wanted < 4.001:
        assert angle is Rejection.OUT_OF_RANGE


@pytest.mark.parametrize(
    ("counts", "reason"),
    [
        (1.1, Rejection.OUT_OF_RANGE),
        (-1.1, Rejection.OUT_OF_RANGE),
        (math.nan, Rejection.NOT_FINITE),
        (math.inf, Rejection.NOT_FINITE),
    ],
)
def test_impossible_angles_are_refused(counts: float, reason: Rejection) -> None:
    assert one(Channel("j", "a", min_rad=-1.0, max_rad=1.0), counts) is reason


def test_a_jump_is_refused_until_the_joint_could_have_got_there() -> None:
    converter = AngleConverter((Channel("j", "a", max_rate_rad_s=10.0),))
    assert converter.convert((0.0,), 0) == [0.0]
    assert converter.convert((0.05,), 10 * MS) == [0.05]
    assert converter.convert((1.0,), 20 * MS) is Rejection.TOO_FAST
    assert converter.convert((0.1,), 30 * MS) == [0.1]
    assert converter.convert((1.0,), 200 * MS) == [1.0]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sign": 2}, "sign"),
        ({"rad_per_count": 0.0}, "scale"),
        ({"rad_per_count": -1.0}, "scale"),
        ({"min_rad": 1.0, "max_rad": 1.0}, "limit"),
        ({"wrap": True, "min_rad": -4.0, "max_rad": 4.0}, "single-turn"),
    ],
)
def test_senseless_channels_are_refused(arguments: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=f"joint j: .*{message}"):
        Channel("j", "a", **arguments)  # type: ignore[arg-type]


def builder(**counting: int) -> tuple[SampleBuilder, LinkStats]:
    stats = LinkStats()
    return SampleBuilder((Channel("j", "a"),), Counting(**counting), stats), stats


def test_sequence_gaps_are_losses_and_wraps_are_not() -> None:
    build, stats = builder(seq_modulus=256)
    seqs = []
    for k, raw in enumerate([250, 251, 255, 0, 1, 3]):
        sample = build.build(RawReading((0.0,), seq=raw), (k + 1) * MS)
        assert sample is not None
        seqs.append(sample.seq)
    assert [b - a for a, b in pairwise(seqs)] == [1, 4, 1, 1, 2]
    assert (stats.lost, stats.seq_jumps) == (4, 0)


def test_a_counter_that_restarts_is_not_a_loss() -> None:
    build, stats = builder(seq_modulus=1 << 16)
    for k, raw in enumerate([40_000, 40_001, 0, 1]):
        assert build.build(RawReading((0.0,), seq=raw), (k + 1) * MS) is not None
    assert (stats.lost, stats.seq_jumps) == (0, 1)


def test_repeated_readings_are_refused() -> None:
    build, stats = builder(seq_modulus=256, tick_ns=1000)
    assert build.build(RawReading((0.0,), seq=1, ticks=1000), MS) is not None
    assert build.build(RawReading((0.0,), seq=1, ticks=1000), 2 * MS) is None
    assert stats.rejected == {Rejection.DUPLICATE: 1}


def test_a_frozen_clock_with_a_running_counter_yields_no_fresh_samples() -> None:
    build, stats = builder(seq_modulus=256, tick_ns=1000)
    fresh = [build.build(RawReading((0.0,), seq=k % 256, ticks=1000), 15 * k * MS) for k in range(1, 100)]
    assert sum(sample is not None for sample in fresh) == 1
    assert stats.rejected[Rejection.NOT_ADVANCING] == 98


def test_fault_bits_refuse_and_other_bits_do_not() -> None:
    build, stats = builder(fault_mask=0b110)
    assert build.build(RawReading((0.0,), status=0b001), MS) is not None
    assert build.build(RawReading((0.0,), status=0b010), 2 * MS) is None
    assert stats.rejected == {Rejection.DEVICE_FAULT: 1}


def test_capture_time_comes_from_the_device_clock_and_not_from_delivery() -> None:
    build, _ = builder(tick_ns=1000, latency_ns=MS)
    delays_ms = [1, 1, 1, 9, 1, 5]
    captures = []
    for k, delay_ms in enumerate(delays_ms):
        sample = build.build(RawReading((0.0,), ticks=15_000 * k), (15 * k + delay_ms) * MS)
        assert sample is not None
        assert sample.t_device_ns == 15 * k * MS
        captures.append(sample.t_capture_ns)
    assert captures == [15 * k * MS for k in range(6)]


def test_without_a_device_clock_the_known_latency_is_taken_off() -> None:
    build, _ = builder(latency_ns=3 * MS)
    sample = build.build(RawReading((0.0,)), 10 * MS)
    assert sample is not None
    assert (sample.t_capture_ns, sample.t_arrival_ns) == (7 * MS, 10 * MS)


def test_a_stamp_from_nowhere_is_refused() -> None:
    build, stats = builder(tick_ns=1000)
    for k in range(20):
        assert build.build(RawReading((0.0,), ticks=15_000 * k), (15 * k + 1) * MS) is not None
    assert build.build(RawReading((0.0,), ticks=9_000_000), 15 * 20 * MS) is None
    assert build.build(RawReading((0.0,), ticks=15_000 * 21), (15 * 21 + 1) * MS) is not None
    assert stats.rejected == {Rejection.CLOCK_SUSPECT: 1}
