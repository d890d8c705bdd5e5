"""What a session gives, and the sessions that are refused, each with its reason."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from ghest_rt.calibration.arm_axis import ArmAxis
from ghest_rt.calibration.calibrate import Outcome, calibrate, new_station_text
from ghest_rt.calibration.hold import find_hold
from ghest_rt.calibration.options import CalibrationOptions
from ghest_rt.calibration.report import notes_of, rows_of
from ghest_rt.calibration.session import Session
from ghest_rt.calibration.verdict import Refusal
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.errors import BadInputError
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, angle_between_rad
from tests.calibration.synthetic import (
    ARM_M,
    M0_FROM_GH,
    M1_FROM_ELW,
    angles,
    at,
    only,
    session,
    with_frozen_encoders,
    with_slide,
    with_wander,
)

OPTIONS = CalibrationOptions(calibration_id="new")


@pytest.fixture(scope="module")
def station() -> LoadedStation:
    return load_station(shipped_config_dir() / "station-sim.toml")


def test_a_good_session_gives_centres_attitudes_and_reference(station: LoadedStation) -> None:
    outcome = calibrate(session(), station, OPTIONS)
    new = outcome.calibration
    assert outcome.objections == ()
    assert new is not None
    m0_from_gh, m1_from_elw = np.array(new.m0_from_gh), np.array(new.m1_from_elw)
    assert m0_from_gh[:3, 3] == pytest.approx(M0_FROM_GH[:3, 3], abs=0.0005)
    assert m1_from_elw[:3, 3] == pytest.approx(M1_FROM_ELW[:3, 3], abs=0.0005)
    assert math.degrees(angle_between_rad(m0_from_gh[:3, :3], M0_FROM_GH[:3, :3])) < 0.05
    assert math.degrees(angle_between_rad(m1_from_elw[:3, :3], M1_FROM_ELW[:3, :3])) < 0.05
    assert new.arm_length_m == pytest.approx(ARM_M, abs=0.0005)
    assert new.reference.elbow_in_link_m == pytest.approx((0.0, 0.0, 0.0), abs=0.0005)
    assert new.reference.forearm_twist_deg == pytest.approx(0.0, abs=0.05)
    assert new.link_from_camera == station.config.calibration.link_from_camera
    assert new.reference.elbow_sigma_m == station.config.calibration.reference.elbow_sigma_m


def test_a_measured_arm_moves_the_elbow_along_the_arm_and_nothing_else(station: LoadedStation) -> None:
    found = calibrate(session(), station, OPTIONS).calibration
    measured = calibrate(session(), station, replace(OPTIONS, arm_length_m=0.33)).calibration
    assert found is not None
    assert measured is not None
    assert measured.arm_length_m == 0.33
    assert measured.m0_from_gh == found.m0_from_gh
    apart = np.array(measured.m1_from_elw) - np.array(found.m1_from_elw)
    assert apart[:3, :3] == pytest.approx(np.zeros((3, 3)), abs=1e-8)
    assert apart[:3, 3] == pytest.approx(-0.02 * np.array(found.m1_from_elw)[:3, 1], abs=0.0005)


def test_without_the_elbow_moving_the_station_file_tells_the_arms_length(station: LoadedStation) -> None:
    stiff = session(lambda t_s: (*angles(t_s)[:3], math.radians(90.0)))
    outcome = calibrate(stiff, station, replace(OPTIONS, posture_unchecked=True))
    assert outcome.objections == ()
    assert outcome.found is not None
    assert "kept from the station file" in outcome.found.length.source
    with pytest.raises(BadInputError, match="bend and stretch it"):
        calibrate(stiff, station, replace(OPTIONS, elbow_from=ArmAxis.EXOSKELETON))


def test_the_exoskeletons_elbow_gives_the_arms_axis_if_asked_for(station: LoadedStation) -> None:
    tilted = session(lambda t_s: (angles(t_s)[0] + math.radians(4.0), *angles(t_s)[1:]))
    by_posture = calibrate(tilted, station, OPTIONS).calibration
    by_elbow = calibrate(tilted, station, replace(OPTIONS, elbow_from=ArmAxis.EXOSKELETON)).calibration
    assert by_posture is not None
    assert by_elbow is not None
    along = [np.array(new.m1_from_elw)[:3, 1] for new in (by_posture, by_elbow)]
    off_deg = [math.degrees(np.linalg.norm(axis - M1_FROM_ELW[:3, 1])) for axis in along]
    assert off_deg[0] == pytest.approx(4.0, abs=0.1)
    assert off_deg[1] < 0.2
    measured = calibrate(tilted, station, replace(OPTIONS, elbow_from=ArmAxis.EXOSKELETON, arm_length_m=0.29)).calibration
    assert measured is not None
    assert measured.arm_length_m == 0.29
    assert np.array(measured.m1_from_elw)[:3, 1] == pytest.approx(along[1])


def scaled(a: float = 1.0, b: float = 1.0, g: float = 1.0) -> Session:
    def movement(t_s: float) -> tuple[float, float, float, float]:
        whole = angles(t_s)
        return a * whole[0], b * whole[1], g * whole[2], whole[3]

    return session(movement)


def restless(t_s: float) -> tuple[float, float, float, float]:
    a, b, g, bend = angles(t_s + 4.0)
    return a, b, g, bend


def turned(a_deg: float = 0.0, g_deg: float = 0.0, bend_deg: float = 0.0, *, stiff: bool = False) -> Session:
    def movement(t_s: float) -> tuple[float, float, float, float]:
        a, b, g, bend = angles(t_s)
        elbow = math.radians(90.0) if stiff else bend + math.radians(bend_deg)
        return a + math.radians(a_deg), b, g + math.radians(g_deg), elbow

    return session(movement)


def swapped() -> Session:
    """The markers mixed up: m0 on the arm, m1 on the acromion."""
    whole = session()
    return replace(whole, e_from_m0=whole.e_from_m1, e_from_m1=whole.e_from_m0)


def far_off() -> Session:
    """Marker m0 seen 0.6 m from where it is."""
    whole = session()
    return replace(whole, e_from_m0=whole.e_from_m0 @ transform(np.eye(3), (0.6, 0.0, 0.0)))


@pytest.mark.parametrize(
    ("made", "refusal"),
    [
        (lambda: only(session(), 0.4), Refusal.SEEN_TOO_SELDOM),
        (lambda: session(seconds=7.0), Refusal.SEEN_TOO_SELDOM),
        (lambda: session(restless), Refusal.NOT_STILL),
        (lambda: scaled(a=0.2), Refusal.RANGE_TOO_SMALL),
        (lambda: scaled(g=0.1), Refusal.RANGE_TOO_SMALL),
        (lambda: scaled(0.0, 0.0, 0.0), Refusal.RANGE_TOO_SMALL),
        (lambda: session(noise_m=0.0026), Refusal.RESIDUAL_TOO_LARGE),
        (lambda: with_slide(session(), 9.0, np.array([0.0, 0.0, 0.03])), Refusal.RESIDUAL_TOO_LARGE),
        (lambda: turned(a_deg=25.0), Refusal.NOT_NEUTRAL),
        (lambda: turned(bend_deg=-60.0), Refusal.ELBOW_NOT_BENT),
        (lambda: turned(a_deg=40.0, stiff=True), Refusal.POSTURE_UNCHECKED),
        (lambda: replace(turned(a_deg=40.0, stiff=True), forearm_in_e=None), Refusal.POSTURE_UNCHECKED),
        (lambda: only(session(seconds=10.0), 0.65), Refusal.SEEN_TOO_SELDOM),
        (lambda: with_wander(scaled(0.6, 0.6, 0.6), 0.003), Refusal.CENTRE_UNCERTAIN),
        (lambda: with_frozen_encoders(session()), Refusal.IMPLAUSIBLE),
        (swapped, Refusal.IMPLAUSIBLE),
        (far_off, Refusal.IMPLAUSIBLE),
    ],
)
def test_a_session_that_is_not_good_enough_is_refused(
    station: LoadedStation, made: Callable[[], Session], refusal: Refusal
) -> None:
    outcome: Outcome = calibrate(made(), station, OPTIONS)
    assert refusal in [objection.refusal for objection in outcome.objections], outcome.objections
    assert outcome.calibration is None
    if outcome.found is not None:
        assert rows_of(station.config.calibration, outcome.found)


def test_a_posture_that_nothing_vouches_for_is_taken_only_if_asked_for_and_said_so(station: LoadedStation) -> None:
    outcome = calibrate(turned(a_deg=40.0, stiff=True), station, replace(OPTIONS, posture_unchecked=True))
    assert outcome.objections == ()
    assert outcome.found is not None
    assert any("NOT CHECKED: whether the arm pointed forward" in note for note in notes_of(outcome.found))


def test_without_a_forearm_on_the_exoskeleton_its_part_is_said_to_be_unchecked(station: LoadedStation) -> None:
    outcome = calibrate(replace(session(), forearm_in_e=None), station, OPTIONS)
    assert outcome.objections == ()
    assert outcome.found is not None
    assert [note for note in notes_of(outcome.found) if "NOT CHECKED" in note and "forearm" in note]


@pytest.mark.parametrize("rate_hz", [5.0, 10.0, 200.0])
def test_a_slow_station_and_a_fast_one_can_be_calibrated(station: LoadedStation, rate_hz: float) -> None:
    outcome = calibrate(session(rate_hz=rate_hz), station, OPTIONS)
    assert outcome.objections == ()
    assert outcome.found is not None
    assert outcome.found.hold.end_s == pytest.approx(4.0, abs=1.1)


@pytest.mark.parametrize("seen", [lambda t: t < 0.5, lambda t: t % 2.0 < 0.5])
def test_a_posture_seen_for_a_fraction_of_its_time_is_not_held_still(seen: Callable[[Array], NDArray[np.bool_]]) -> None:
    whole = session(angles)
    moving = whole.t_s >= 4.0
    assert find_hold(whole) is not None
    assert find_hold(at(whole, np.flatnonzero(moving | seen(whole.t_s)))) is None


def test_a_recordings_name_cannot_break_the_station_file(station: LoadedStation) -> None:
    outcome = calibrate(session(), station, OPTIONS)
    assert outcome.calibration is not None
    assert outcome.found is not None
    text = new_station_text(station, outcome.calibration, outcome.found.hold, "a\n[joint]\x1b\r.mcap")
    assert "from a?[joint]??.mcap," in text


def test_a_name_that_no_station_file_takes_is_refused() -> None:
    for name in ("patient 1", "", "a" * 65, "a\n"):
        with pytest.raises(BadInputError, match="--id"):
            CalibrationOptions(calibration_id=name)
