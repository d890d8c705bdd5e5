"""Delays are measured though the clocks do not agree."""

import math

import numpy as np
import pytest

from ghest_rt.client.delay import DelayMeter

SLOT_NS = 15_015_015
OFFSET_NS = -7_777_777_777_777


def test_an_unknown_offset_of_the_clocks_does_not_matter() -> None:
    meter = DelayMeter()
    way_ns = np.random.default_rng(1).exponential(300_000, 500).astype(int)
    delays = [meter.measure(k * SLOT_NS + OFFSET_NS + int(way_ns[k]), k * SLOT_NS) for k in range(500)]
    assert max(delays) < 5_000_000
    assert meter.measure(500 * SLOT_NS + OFFSET_NS + 400_000_000, 500 * SLOT_NS) == pytest.approx(400e6, rel=0.01)


def test_a_clock_that_runs_faster_is_not_taken_for_delay() -> None:
    meter = DelayMeter()
    drift = 100e-6  # far worse than a quartz
    delays = [meter.measure(k * SLOT_NS, round(k * SLOT_NS * (1 - drift))) for k in range(66 * 600)]
    assert max(delays) < 5_000_000


def test_a_burst_after_a_hold_up_is_late_and_then_all_is_well_again() -> None:
    meter = DelayMeter()
    for k in range(200):
        meter.measure(k * SLOT_NS, k * SLOT_NS)
    released_ns = 300 * SLOT_NS
    late = [meter.measure(released_ns, k * SLOT_NS) for k in range(200, 300)]
    assert late[0] == 100 * SLOT_NS
    assert late == sorted(late, reverse=True)
    assert meter.measure(301 * SLOT_NS, 301 * SLOT_NS) == 0


def test_a_sample_that_was_asked_for_is_as_late_as_it_is_old() -> None:
    meter = DelayMeter()
    assert meter.delay_ms(5, 5) == math.inf
    meter.measure(1_000_000, 0)
    assert meter.delay_ms(301_000_000, 0) == pytest.approx(300.0)
