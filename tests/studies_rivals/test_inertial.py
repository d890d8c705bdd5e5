"""The inertial rival: exact without noise, drifting with it, never told the truth after its start."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ghest_rt.geometry.so3 import Array, angle_between_rad
from ghest_rt.simulation.scene import arm_from_elw
from ghest_rt.simulation.world import World
from ghest_rt.studies.rivals.inertial import RECOMMENDED_GAIN, ImuProfile, ImuTrack, InertialEstimator, simulate_imus
from tests.studies_rivals.conftest import BODY

PERFECT = ImuProfile(
    gyro_noise_dps_rthz=0.0, gyro_bias_dps=0.0, gyro_bias_walk_dps_rts=0.0, accel_noise_g_rthz=0.0, accel_bias_g=0.0
)


def tracks(world: World, profile: ImuProfile, seed: int = 1) -> tuple[ImuTrack, ImuTrack]:
    start_ns, end_ns = world.timeline.start_ns, world.timeline.end_ns
    return simulate_imus(world.truth_at, start_ns, end_ns, profile, seed)


def errors_deg(world: World, scapula: ImuTrack, arm: ImuTrack, gain: float = RECOMMENDED_GAIN) -> Array:
    calibration = world.station.config.calibration
    gh_from_m0 = np.array(calibration.m0_from_gh)[:3, :3].T
    arm_from_m1 = (arm_from_elw(BODY.upper_arm_m) @ np.linalg.inv(np.array(calibration.m1_from_elw)))[:3, :3]
    estimator = InertialEstimator(scapula, arm, gh_from_m0, arm_from_m1, gain)
    errors = []
    for k in range(2, int(66.6 * world.timeline.duration_s), 4):
        t_ns = world.timeline.grid_ns(k)
        rotation = estimator.estimate(t_ns).gh_from_arm
        assert rotation is not None
        errors.append(math.degrees(angle_between_rad(world.truth_at(t_ns).gh_from_arm, rotation)))
    return np.array(errors)


def test_at_rest_the_accelerometer_feels_one_g_and_the_gyroscope_nothing(comb: World) -> None:
    still = comb.truth_at(comb.timeline.start_ns)
    scapula, arm = simulate_imus(lambda t_ns: replace(still, t_ns=t_ns), 0, 500_000_000, PERFECT, seed=1)
    for track in (scapula, arm):
        np.testing.assert_allclose(np.linalg.norm(track.accel_g, axis=1), 1.0, atol=1e-9)
        np.testing.assert_allclose(track.gyro_dps, 0.0, atol=1e-9)


def test_perfect_gyroscopes_alone_track_the_arm_exactly(comb: World) -> None:
    assert errors_deg(comb, *tracks(comb, PERFECT), gain=0.0).max() < 0.01


def test_accelerometers_take_movement_for_gravity(comb: World) -> None:
    errors = errors_deg(comb, *tracks(comb, PERFECT))
    assert 0.3 < errors.max() < 3.0


def test_an_offset_of_the_gyroscope_makes_the_error_grow(comb: World) -> None:
    errors = errors_deg(comb, *tracks(comb, replace(PERFECT, gyro_bias_dps=1.0)))
    assert errors[-1] > errors[3] + 0.5


def test_what_the_library_learns_of_the_offset_while_a_sensor_is_still_is_taken_off(comb: World) -> None:
    still = comb.truth_at(comb.timeline.start_ns)

    def error_deg(correct_offset: bool) -> float:
        profile = replace(PERFECT, gyro_bias_dps=0.5)
        scapula, arm = simulate_imus(lambda t_ns: replace(still, t_ns=t_ns), 0, 20_000_000_000, profile, seed=1)
        estimator = InertialEstimator(scapula, arm, np.eye(3), np.eye(3), correct_offset=correct_offset)
        before, after = (estimator.estimate(t_ns).gh_from_arm for t_ns in (10_000_000_000, 20_000_000_000))
        assert before is not None
        assert after is not None
        return math.degrees(angle_between_rad(before, after))

    assert error_deg(True) < 0.5 * error_deg(False)


def test_a_wrong_attitude_at_the_start_is_kept(comb: World) -> None:
    scapula, arm = tracks(comb, PERFECT)
    turned = np.array([[math.cos(0.1), -math.sin(0.1), 0.0], [math.sin(0.1), math.cos(0.1), 0.0], [0.0, 0.0, 1.0]])
    errors = errors_deg(comb, scapula, replace(arm, earth_from_sensor=turned @ arm.earth_from_sensor))
    assert np.degrees(0.1) - 1.0 < errors.min()  # heading: no gravity to correct it by, and no truth


def test_the_seed_decides_the_noise(comb: World) -> None:
    first, again, other = (tracks(comb, ImuProfile(), seed)[0] for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.gyro_dps, again.gyro_dps)
    assert not np.array_equal(first.gyro_dps, other.gyro_dps)


@pytest.mark.parametrize("offset_ns", [-1_000_000_000, 60_000_000_000])
def test_outside_its_samples_there_is_no_answer(comb: World, offset_ns: int) -> None:
    scapula, arm = tracks(comb, PERFECT)
    estimator = InertialEstimator(scapula, arm, np.eye(3), np.eye(3))
    assert estimator.estimate(comb.timeline.start_ns + offset_ns).gh_from_arm is None
