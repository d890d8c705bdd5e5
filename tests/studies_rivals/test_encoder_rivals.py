"""The rivals that rest on the encoders: right where their assumptions hold, wrong where these do not."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from ghest_rt.config.load import parse_station
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.angles import clinical, euler_yxz
from ghest_rt.estimation.interface import GhEstimator
from ghest_rt.geometry.so3 import Array, angle_between_rad
from ghest_rt.messages.results import Reason, Status
from ghest_rt.simulation.posture import Motion
from ghest_rt.simulation.world import World
from ghest_rt.studies.rivals.encoder_only import EncoderOnlyEstimator
from ghest_rt.studies.rivals.neutral import NeutralCalibration
from ghest_rt.studies.rivals.running import encoder_models, run_estimator
from tests.studies_rivals.conftest import ArmOnly

KEYS = ("exoskeleton", "coupled_chain", "swivel", "swivel_wrist")


def errors_deg(world: World, calibration: NeutralCalibration, key: str, lag_ns: int = 20_000_000) -> Array:
    estimator = EncoderOnlyEstimator(encoder_models(calibration)[key], calibration.kinematics.limits, 100_000_000)
    rows = [row for k in range(world.encoder_count) if (row := world.encoder_sample(k)) is not None]
    instants = [world.timeline.grid_ns(k) for k in range(0, int(66.6 * world.timeline.duration_s), 3)]
    answers = run_estimator(estimator, rows, instants, lag_ns)
    return np.array(
        [
            math.nan if R is None else math.degrees(angle_between_rad(world.truth_at(t).gh_from_arm, R))
            for t, R in zip(answers.t_ns, answers.gh_from_arm, strict=True)
        ]
    )


@pytest.mark.parametrize("key", KEYS)
def test_in_the_posture_of_calibration_every_rival_is_right(calibration: NeutralCalibration, key: str) -> None:
    rotation = encoder_models(calibration)[key].gh_from_arm(calibration.joints)
    assert rotation is not None
    assert math.degrees(angle_between_rad(np.eye(3), rotation)) < 1e-6


def test_the_exoskeletons_joints_are_read_as_the_angles_of_their_names(calibration: NeutralCalibration) -> None:
    names = calibration.station.config.encoders.joints
    turned = {name: calibration.joints.copy() for name in ("j0", "j1", "j2", "j6", "j4", "j8")}
    for name, joints in turned.items():
        joints[names.index(name)] += 0.1
    model = encoder_models(calibration)["exoskeleton"]
    angles = {name: clinical(euler_yxz(R), "right") for name, q in turned.items() if (R := model.gh_from_arm(q)) is not None}
    assert angles["j0"].abduction_rad == pytest.approx(-0.1)
    assert angles["j1"].abduction_rad == pytest.approx(-0.1)
    assert angles["j2"].flexion_rad == pytest.approx(-0.1)
    assert angles["j6"].rotation_rad == pytest.approx(0.1)
    for name in ("j4", "j8"):  # elbow and forearm say nothing about the shoulder
        assert angles[name].flexion_rad == pytest.approx(0.0, abs=1e-12)


def test_the_coupled_chain_is_right_while_the_girdle_rests(
    calibration: NeutralCalibration, world_of: Callable[[Motion], World]
) -> None:
    world = world_of(ArmOnly())
    chain, alone = (errors_deg(world, calibration, key) for key in ("coupled_chain", "exoskeleton"))
    assert np.nanmax(chain) < 0.3
    assert np.nanmax(alone) > 3.0  # misaligned axes


def test_what_the_girdle_does_the_coupled_chain_does_not_see(calibration: NeutralCalibration, comb: World) -> None:
    errors = errors_deg(comb, calibration, "coupled_chain")
    assert 1.0 < np.sqrt(np.nanmean(np.square(errors))) < 10.0


def test_a_swivel_model_reaches_the_wrist_with_the_patients_lengths(calibration: NeutralCalibration, comb: World) -> None:
    model = encoder_models(calibration)["swivel"]
    body = calibration.body
    for k in range(20, comb.encoder_count, 40):
        sample = comb.encoder_sample(k)
        assert sample is not None
        rotation = model.gh_from_arm(sample.angles_rad)
        assert rotation is not None
        np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1.0)
        elbow_m = calibration.gh_in_e_m - body.upper_arm_m * rotation[:, 2]
        module = calibration.kinematics.link_pose("l8", sample.angles_rad)
        neutral = calibration.kinematics.link_pose("l8", calibration.joints)
        wrist_m = (module @ np.linalg.inv(neutral) @ np.append(calibration.e_from_hand[:3, 3], 1.0))[:3]
        assert np.linalg.norm(wrist_m - elbow_m) == pytest.approx(body.forearm_m, abs=1e-9)
        assert abs(float((wrist_m - elbow_m) @ rotation[:, 0])) < 1e-9  # the elbow's axis is across the forearm


def test_the_wrists_orientation_makes_a_difference(calibration: NeutralCalibration, comb: World) -> None:
    plain, aware = (errors_deg(comb, calibration, key) for key in ("swivel", "swivel_wrist"))
    assert np.nanmean(np.abs(plain - aware)) > 1.0


def test_without_rows_on_both_sides_there_is_no_answer(calibration: NeutralCalibration, comb: World) -> None:
    estimator = EncoderOnlyEstimator(encoder_models(calibration)["exoskeleton"], calibration.kinematics.limits, 100_000_000)
    assert isinstance(estimator, GhEstimator)
    first, second = comb.encoder_sample(0), comb.encoder_sample(2)
    assert first is not None
    assert second is not None
    estimator.add_encoder(first)
    before = estimator.estimate(second.t_capture_ns - 1_000_000)
    assert (before.status, before.reason, before.gh_from_arm) == (Status.LOST, Reason.ENCODERS_SILENT, None)
    assert before.newest_ns == {"encoders": first.t_capture_ns}
    estimator.add_encoder(second)
    assert estimator.estimate(second.t_capture_ns - 1_000_000).status is Status.VALID


def test_a_left_arm_is_refused_by_name(calibration: NeutralCalibration) -> None:
    text = calibration.station.toml_text.replace('arm = "right"', 'arm = "left"')
    left = replace(calibration.station, toml_text=text, config=parse_station(text, calibration.station.source))
    with pytest.raises(BadInputError, match="right arm"):
        NeutralCalibration(left, calibration.body, calibration.joints)
