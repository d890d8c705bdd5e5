"""How answers are judged, and how a row is called."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from ghest_rt.estimation.angles import rotation_from_clinical
from ghest_rt.geometry.so3 import rot_y, rot_z
from ghest_rt.messages.results import TruthSample
from ghest_rt.studies.compare.verdicts import Tally, tally, verdict
from ghest_rt.studies.latency.study import effective_delay_ms
from ghest_rt.studies.latency.tasks import PlayedAt
from ghest_rt.studies.rivals.angle_errors import (
    Answers,
    error_columns,
    error_statistics,
    girdle_turn_deg,
    on_common_instants,
    simple_forecasts_deg,
)
from ghest_rt.studies.rivals.contenders import CONTENDERS
from ghest_rt.studies.truth import TruthTrack
from tests.studies_rivals.conftest import ArmOnly

STEP_NS = 10_000_000


def truth_of(gh: Callable[[float], np.ndarray], count: int = 30) -> TruthTrack:
    return TruthTrack.of([sample(k * STEP_NS, gh(k * STEP_NS * 1e-9)) for k in range(count)])


def sample(t_ns: int, gh: np.ndarray) -> TruthSample:
    e_from_arm = np.eye(4)
    e_from_arm[:3, :3] = gh
    return TruthSample(t_ns, gh, np.eye(4), np.eye(4), np.eye(4), e_from_arm, {})


def test_an_answer_that_comes_late_is_judged_by_where_the_arm_is_by_then() -> None:
    speed_radps = 1.0
    truth = truth_of(lambda t: rot_y(speed_radps * t))
    t_ns = [5 * STEP_NS, 6 * STEP_NS]
    columns = error_columns(Answers(t_ns, [truth.at(t).gh_from_arm for t in t_ns], 3 * STEP_NS), truth)  # type: ignore[union-attr]
    np.testing.assert_allclose(columns["orientation_deg"], 0.0, atol=1e-6)
    np.testing.assert_allclose(columns["published_deg"], math.degrees(0.03), rtol=1e-6)


def test_single_angles_are_told_apart_and_signed() -> None:
    truth = truth_of(lambda _: rotation_from_clinical(0.2, 0.1, -0.3, "right"))
    answers = Answers([STEP_NS], [rotation_from_clinical(0.25, 0.08, -0.3, "right")], 0)
    columns = error_columns(answers, truth)
    assert columns["flexion_deg"][0] == pytest.approx(math.degrees(0.05))
    assert columns["abduction_deg"][0] == pytest.approx(math.degrees(-0.02))
    assert columns["rotation_deg"][0] == pytest.approx(0.0, abs=1e-9)


def test_half_a_turn_is_never_more_than_half_a_turn() -> None:
    truth = truth_of(lambda _: rotation_from_clinical(0.0, 0.0, math.pi - 0.01, "right"))
    answers = Answers([STEP_NS], [rotation_from_clinical(0.0, 0.0, -math.pi + 0.01, "right")], 0)
    assert error_columns(answers, truth)["rotation_deg"][0] == pytest.approx(math.degrees(0.02))


def test_near_the_singularity_only_the_rotation_is_judged() -> None:
    truth = truth_of(lambda _: rotation_from_clinical(0.0, math.radians(85.0), 0.0, "right"))
    found = error_statistics(Answers([STEP_NS], [np.eye(3)], 0), truth)
    assert found["orientation_deg"] == pytest.approx(85.0)
    assert math.isnan(found["flexion_deg"])
    assert found["angles_judged_fraction"] == 0.0


def test_what_is_not_answered_is_counted_and_not_judged() -> None:
    truth = truth_of(lambda _: np.eye(3))
    found = error_statistics(Answers([STEP_NS, 2 * STEP_NS, 10**12], [rot_z(0.01), None, np.eye(3)], 0), truth)
    assert found["samples"] == 2
    assert found["answered_fraction"] == 0.5
    assert found["orientation_deg"] == pytest.approx(math.degrees(0.01))


def test_the_girdles_turn_is_what_lies_between_trunk_and_gh_joint() -> None:
    turned = sample(0, np.eye(3))
    turned.e_from_arm[:3, :3] = rot_z(0.1)
    assert girdle_turn_deg([turned]) == pytest.approx(math.degrees(0.1))


def test_a_steady_turn_is_foreseen_by_going_straight_on_and_a_jerk_is_not() -> None:
    instants = [k * STEP_NS for k in range(4, 25)]
    steady = truth_of(lambda t: rot_y(2.0 * t))
    found = simple_forecasts_deg(steady, instants, STEP_NS)
    assert found["straight_forecast_deg"] == pytest.approx(0.0, abs=1e-6)
    assert found["hold_forecast_deg"] == pytest.approx(math.degrees(2.0 * 0.01))
    jerk = truth_of(lambda t: rot_y(0.5 * 40.0 * t * t))  # 40 rad/s^2: a t^2 each step
    assert simple_forecasts_deg(jerk, instants, STEP_NS)["straight_forecast_deg"] == pytest.approx(
        math.degrees(40.0 * 0.01**2), rel=1e-6
    )


FUSED = {"orientation_deg": 0.1, "published_deg": 0.1, "flexion_deg": 0.05, "abduction_deg": 0.05, "rotation_deg": 0.05}
WORSE = {name: 2.0 * value for name, value in FUSED.items()} | {"answered_fraction": 1.0}
BETTER = {name: 0.5 * value for name, value in FUSED.items()} | {"answered_fraction": 1.0}
FUSED["answered_fraction"] = 1.0


def test_a_row_is_won_only_in_the_rotation_and_in_every_angle() -> None:
    who = CONTENDERS["coupled_chain"]
    assert verdict(who, WORSE, FUSED, 20.0, 0.01).fused_wins
    narrow = verdict(who, {**WORSE, "abduction_deg": 0.01}, FUSED, 20.0, 0.01)
    assert not narrow.fused_wins
    assert narrow.lost_in == ("abduction_deg",)
    assert "abduction 0.050° against 0.010°" in narrow.verdict


def test_an_answer_that_is_better_but_late_is_called_so() -> None:
    said = verdict(CONTENDERS["refined"], {**BETTER, "published_deg": 3.0}, FUSED, 45.0, 0.01)
    assert not said.fused_wins
    assert said.fused_wins_when_published
    assert "45 ms after its instant" in said.verdict
    assert "3.00°" in said.verdict


def test_a_row_that_is_lost_names_what_the_other_has_on_its_side() -> None:
    who = CONTENDERS["inertial"]
    said = verdict(who, BETTER, FUSED, 15.0, 0.2)
    assert not said.fused_wins
    assert not said.fused_wins_when_published
    assert who.strength in said.verdict
    assert "off by 0.200°" in said.verdict
    assert "does not reach" not in said.verdict
    assert "does not reach" in verdict(who, BETTER, FUSED, 15.0, 0.05).verdict


def test_who_never_answers_has_lost() -> None:
    nowhere = dict.fromkeys(FUSED, math.nan)
    silent = {**nowhere, "answered_fraction": 0.0}
    assert verdict(CONTENDERS["aruco"], silent, {**nowhere, "answered_fraction": 1.0}, 45.0, 0.01).fused_wins
    ours = verdict(CONTENDERS["aruco"], {**nowhere, "answered_fraction": 0.75}, silent, 45.0, 0.01)
    assert not ours.fused_wins
    assert not ours.fused_wins_when_published
    assert "0.0 % of the instants against 75.0 %" in ours.verdict
    flexion = {**FUSED, "flexion_deg": math.nan}
    assert verdict(
        CONTENDERS["aruco"], {**WORSE, "flexion_deg": math.nan}, flexion, 45.0, 0.01
    ).fused_wins  # near its singularity


def test_silence_wins_nothing() -> None:
    seldom = verdict(CONTENDERS["aruco"], WORSE, {**FUSED, "answered_fraction": 0.6}, 45.0, 0.01)
    assert not seldom.fused_wins
    assert seldom.lost_in == ("answered_fraction",)
    assert "answered are 60.0 % of the instants against 100 %" in seldom.verdict
    started_later = verdict(CONTENDERS["aruco"], WORSE, {**FUSED, "answered_fraction": 0.995}, 45.0, 0.01)
    assert started_later.fused_wins
    rival = verdict(CONTENDERS["aruco"], {**WORSE, "answered_fraction": 0.6}, FUSED, 45.0, 0.01)
    assert rival.fused_wins
    assert "where both answer; answered are 100 % of the instants against 60.0 %" in rival.verdict


def test_two_are_judged_where_both_answer() -> None:
    truth = truth_of(lambda _: np.eye(3))
    instants = [k * STEP_NS for k in range(1, 5)]
    easy, hard = rot_z(0.01), rot_z(0.4)
    theirs = Answers(instants, [easy, easy, None, None], 0)
    fused = Answers(instants, [easy, None, hard, hard], 0)
    found = on_common_instants(theirs, fused, truth)
    assert found["common_fraction"] == 0.25
    assert found["common_orientation_deg"] == found["fused_common_orientation_deg"] == pytest.approx(math.degrees(0.01))
    assert error_statistics(fused, truth)["orientation_deg"] > 10.0
    later = Answers([t_ns + 1 for t_ns in instants], fused.gh_from_arm, 0)
    assert math.isnan(on_common_instants(theirs, later, truth)["common_orientation_deg"])


def test_rows_are_counted_by_sensor_and_kind() -> None:
    rows = [
        {
            "contender": "aruco",
            "sensor": sensor,
            "kind": kind,
            "fused_wins": sensor == "paper",
            "fused_wins_when_published": True,
        }
        for sensor in ("paper", "sr300")
        for kind in ("therapy", "therapy", "recorded")
    ]
    assert tally(rows, "aruco", "paper", "therapy") == Tally(2, 2, 2)
    assert tally(rows, "aruco", "sr300", "recorded") == Tally(1, 0, 1)
    assert tally(rows, "swivel", "paper", "therapy").rows == 0


def test_every_contender_says_what_its_publication_reports_and_what_to_bear_in_mind() -> None:
    for who in CONTENDERS.values():
        assert who.title
        assert who.source
        assert who.published
        assert who.caveat
        assert who.strength or who.key == "fused"


def test_the_delay_behind_the_arm_is_the_slope_of_error_against_speed() -> None:
    speed_dps = np.linspace(1.0, 100.0, 50)
    assert effective_delay_ms(speed_dps, 0.045 * speed_dps) == pytest.approx(45.0)
    assert math.isnan(effective_delay_ms(np.zeros(3), np.zeros(3)))


def test_a_movement_played_twice_as_fast_is_the_same_movement() -> None:
    motion = ArmOnly(duration_s=4.0)
    played = PlayedAt(motion, 2.0, span_s=3.0)
    assert played.duration_s == 1.5
    np.testing.assert_array_equal(played.at(0.7).gh, motion.at(0.5 + 1.4).gh)
