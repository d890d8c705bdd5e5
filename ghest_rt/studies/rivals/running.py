"""The rivals over an observed session, on the grid of the marker methods."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ghest_drivers.samples import EncoderSample
from ghest_rt.estimation.interface import GhEstimator
from ghest_rt.geometry.so3 import Array, angle_between_rad
from ghest_rt.messages.results import TruthSample
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.scene import arm_from_elw
from ghest_rt.simulation.sensors import find_sensors
from ghest_rt.studies.observing.observed import Observed
from ghest_rt.studies.observing.scenario import HEIGHT_M
from ghest_rt.studies.rivals.angle_errors import Answers
from ghest_rt.studies.rivals.contenders import CONTENDERS
from ghest_rt.studies.rivals.coupled_chain import CoupledChain
from ghest_rt.studies.rivals.encoder_only import EncoderOnlyEstimator, PostureModel
from ghest_rt.studies.rivals.exoskeleton_alone import ExoskeletonAlone
from ghest_rt.studies.rivals.inertial import ImuProfile, ImuTrack, InertialEstimator, simulate_imus
from ghest_rt.studies.rivals.neutral import NeutralCalibration, calibrate
from ghest_rt.studies.rivals.swivel import SwivelAngle
from ghest_rt.studies.truth import TruthTrack

WITHOUT_CAMERAS = ("exoskeleton", "coupled_chain", "swivel", "swivel_wrist", "inertial")
"""The rivals that look at no marker."""

REST_S = 120.0
"""How long the patient holds still to show what drift does to inertial sensors."""


def run_without_cameras(
    session: Observed, sensor: str, seed: int, instants_ns: Sequence[int], imu: ImuProfile | None = None
) -> dict[str, Answers]:
    """Return what each of `WITHOUT_CAMERAS` says.

    Args:
        session: The observed session.
        sensor: Name of its sensors.
        seed: The session's seed; seeds the inertial sensors as well.
        instants_ns: The grid.
        imu: The inertial sensors; None for the usual ones.
    """
    body = anatomy(HEIGHT_M)
    calibration = calibrate(session.station, body, find_sensors(sensor), seed)
    max_gap_ns = round(session.station.config.estimator.max_gap_ms * 1e6)
    estimators: dict[str, GhEstimator] = {
        key: EncoderOnlyEstimator(model, calibration.kinematics.limits, max_gap_ns)
        for key, model in encoder_models(calibration).items()
    }
    estimators["inertial"] = _inertial_in_motion(session, imu or ImuProfile(), seed)
    return {
        key: run_estimator(estimator, session.encoders, instants_ns, round((CONTENDERS[key].lag_ms or 0.0) * 1e6))
        for key, estimator in estimators.items()
    }


def encoder_models(calibration: NeutralCalibration) -> dict[str, PostureModel]:
    """Return the models of the rivals that rest on the encoders, by key."""
    return {
        "exoskeleton": ExoskeletonAlone(calibration),
        "coupled_chain": CoupledChain(calibration),
        "swivel": SwivelAngle(calibration, wrist_aware=False),
        "swivel_wrist": SwivelAngle(calibration, wrist_aware=True),
    }


def run_estimator(
    estimator: GhEstimator, encoders: Sequence[EncoderSample], instants_ns: Sequence[int], lag_ns: int
) -> Answers:
    """Return what an estimator says at each instant, from the encoder rows that have arrived `lag_ns` later, as live."""
    rows = sorted(encoders, key=lambda row: row.t_arrival_ns)
    given = 0
    estimates = []
    for t_ns in instants_ns:
        while given < len(rows) and rows[given].t_arrival_ns <= t_ns + lag_ns:
            estimator.add_encoder(rows[given])
            given += 1
        estimates.append(estimator.estimate(t_ns))
    return Answers.of(estimates, lag_ns)


def inertial_after_rest_deg(session: Observed, seed: int, rest_s: float = REST_S) -> float:
    """Return by how much the inertial rival is off after the patient of a session has held still: what drift does in time.

    Args:
        session: Its first posture is held.
        seed: Seeds the sensors.
        rest_s: How long.
    """
    still = session.truth[0]
    end_ns = round(rest_s * 1e9)
    tracks = simulate_imus(lambda t_ns: replace(still, t_ns=t_ns), 0, end_ns, ImuProfile(), seed)
    estimator = _inertial(session, tracks)
    rotation = estimator.estimate(end_ns).gh_from_arm
    return math.nan if rotation is None else math.degrees(angle_between_rad(still.gh_from_arm, rotation))


def _inertial_in_motion(session: Observed, profile: ImuProfile, seed: int) -> InertialEstimator:
    truth: Sequence[TruthSample] = session.truth
    track = TruthTrack.of(truth)
    step_ns = round(1e9 / profile.rate_hz)

    def truth_at(t_ns: int) -> TruthSample:
        found = track.at(t_ns)
        if found is None:
            raise ValueError(f"no truth at {t_ns} ns")
        return found

    tracks = simulate_imus(truth_at, truth[0].t_ns + step_ns, truth[-1].t_ns - 3 * step_ns, profile, seed)
    return _inertial(session, tracks)


def _inertial(session: Observed, tracks: tuple[ImuTrack, ImuTrack]) -> InertialEstimator:
    calibration = session.station.config.calibration
    gh_from_m0: Array = np.array(calibration.m0_from_gh)[:3, :3].T
    arm_from_m1 = (arm_from_elw(anatomy(HEIGHT_M).upper_arm_m) @ np.linalg.inv(np.array(calibration.m1_from_elw)))[:3, :3]
    return InertialEstimator(*tracks, gh_from_m0, np.asarray(arm_from_m1))
