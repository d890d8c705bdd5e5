"""The rivals over an observed session, on the grid of the marker methods."""

from collections.abc import Sequence

import numpy as np

from ghest_drivers.samples import EncoderSample
from ghest_rt.estimation.interface import GhEstimator
from ghest_rt.geometry.so3 import Array
from ghest_rt.messages.results import TruthSample
from ghest_rt.simulation.anatomy import Anatomy, anatomy
from ghest_rt.simulation.scene import arm_from_elw
from ghest_rt.simulation.sensors import find_sensors
from ghest_rt.studies.rivals.angle_errors import Answers, truth_track
from ghest_rt.studies.rivals.contenders import CONTENDERS
from ghest_rt.studies.rivals.coupled_chain import CoupledChain
from ghest_rt.studies.rivals.encoder_only import EncoderOnlyEstimator, PostureModel
from ghest_rt.studies.rivals.exoskeleton_alone import ExoskeletonAlone
from ghest_rt.studies.rivals.inertial import ImuProfile, InertialEstimator, simulate_imus
from ghest_rt.studies.rivals.neutral import NeutralCalibration, calibrate
from ghest_rt.studies.rivals.swivel import SwivelAngle
from ghest_rt.studies.session.observed import Observed

WITHOUT_CAMERAS = ("exoskeleton", "coupled_chain", "swivel", "swivel_wrist", "inertial")
"""The rivals that look at no marker."""

_HEIGHT_M = 1.75  # the patient's in every study


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
    body = anatomy(_HEIGHT_M)
    calibration = calibrate(session.station, body, find_sensors(sensor), seed)
    max_gap_ns = round(session.station.config.estimator.max_gap_ms * 1e6)
    estimators: dict[str, GhEstimator] = {
        key: EncoderOnlyEstimator(model, calibration.kinematics.limits, max_gap_ns)
        for key, model in encoder_models(calibration).items()
    }
    estimators["inertial"] = _inertial(session, body, imu or ImuProfile(), seed)
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


def _inertial(session: Observed, body: Anatomy, profile: ImuProfile, seed: int) -> InertialEstimator:
    truth: Sequence[TruthSample] = session.truth
    track = truth_track(truth)
    step_ns = round(1e9 / profile.rate_hz)

    def truth_at(t_ns: int) -> TruthSample:
        found = track.at(t_ns)
        if found is None:
            raise ValueError(f"no truth at {t_ns} ns")
        return found

    scapula, arm = simulate_imus(truth_at, truth[0].t_ns + step_ns, truth[-1].t_ns - 3 * step_ns, profile, seed)
    calibration = session.station.config.calibration
    gh_from_m0: Array = np.array(calibration.m0_from_gh)[:3, :3].T
    arm_from_m1 = (arm_from_elw(body.upper_arm_m) @ np.linalg.inv(np.array(calibration.m1_from_elw)))[:3, :3]
    return InertialEstimator(scapula, arm, gh_from_m0, np.asarray(arm_from_m1))
