"""Capture times of the RealSense driver, from the device's clock and from what its frames say of themselves."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pyrealsense2", reason="needs the extra realsense", exc_type=ImportError)

from ghest_drivers.hardware.realsense.timestamps import TimeDomain
from tests.hardware_cameras.realsense_rig import PERIOD_NS, SETTINGS, Rig, opened


def test_frames_are_stamped_with_device_time_and_not_with_their_arrival(rig: Rig) -> None:
    rng = np.random.default_rng(1)
    host_minus_device_ns = 3_000_000_000
    for k in range(200):
        t_ns = 1_000_000_000 + k * PERIOD_NS
        rig.clock.sleep_until_ns(t_ns + host_minus_device_ns + int(rng.exponential(3e6)))
        rig.send(k, t_ns)
    errors = np.array([frame.t_capture_ns - frame.t_device_ns - host_minus_device_ns for frame in rig.read_all()[-50:]])
    assert abs(errors).max() < 1_000_000  # delays of 3 ms on average, up to 20 ms


def test_latency_and_half_the_exposure_are_taken_off() -> None:
    with opened(replace(SETTINGS, latency_ns=10_000_000, exposure_us=4000)) as rig:
        rig.send(0, 1_000_000_000)
        frame = rig.camera.read(0.0)
        assert frame.t_capture_ns == rig.clock.now_ns() - 10_000_000 - 2_000_000


def test_without_a_stated_latency_one_frame_period_is_assumed() -> None:
    with opened(replace(SETTINGS, latency_ns=None)) as rig:
        rig.send(0, 1_000_000_000)
        assert rig.camera.read(0.0).t_capture_ns == rig.clock.now_ns() - PERIOD_NS


def test_the_frames_own_metadata_says_where_mid_exposure_was(rig: Rig) -> None:
    rig.device.set_metadata("frame_timestamp", 500_000)
    rig.device.set_metadata("sensor_timestamp", 493_000)
    rig.send(0, 1_000_000_000)
    assert rig.camera.read(0.0).t_capture_ns == rig.clock.now_ns() - 7_000_000


def test_capture_times_run_on_over_the_wrap_of_the_counter(rig: Rig) -> None:
    wrap_ns = (1 << 32) * 1000
    frames = []
    for k in range(120):
        t_ns = wrap_ns - 60 * PERIOD_NS + k * PERIOD_NS
        rig.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        rig.send(k, t_ns % wrap_ns)
        frames += rig.read_all()
    assert len(frames) == 120
    steps = np.diff([frame.t_capture_ns for frame in frames])
    assert abs(steps - PERIOD_NS).max() < 100_000
    assert rig.camera.stats.clock_suspect == 0


def test_a_clock_that_steps_back_costs_a_few_frames_and_never_a_wrong_time(rig: Rig) -> None:
    for k in range(60):
        rig.clock.sleep_until_ns(6_000_000_000 + k * PERIOD_NS)
        rig.send(k, (9_000_000_000 if k < 40 else 2_000_000_000) + k * PERIOD_NS)
    frames = rig.read_all()
    assert len(frames) >= 54
    for frame in frames:
        assert abs(frame.t_capture_ns - frame.t_arrival_ns) < 1_000_000
    assert rig.camera.stats.clock_suspect > 0


def test_global_time_is_wall_clock_time(rig: Rig) -> None:
    age_ns = 12_000_000
    rig.send(0, rig.unix_ns + rig.clock.now_ns() - age_ns, domain=TimeDomain.GLOBAL)
    assert abs(rig.camera.read(0.0).t_capture_ns - (rig.clock.now_ns() - age_ns)) < 1000


def test_stamps_do_not_come_from_the_wall_clock() -> None:
    options = {"global_time_enabled": (0.0, 1.0, 1.0)}
    with opened(color_options=options, depth_options=options) as rig:
        assert rig.device.option("global_time_enabled") == (0.0, 0.0)
