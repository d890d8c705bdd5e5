"""What a calibration is worth: angles of a later session with the true, a spoilt, and the calibrated station file.

`python -m benchmarks.calibration [--sensors paper sr300] [--seeds 1,2,3] [--duration 8] [--soft-tissue none] [--wrong-mounts]`
from the project's root. Centres are spoilt by 15 mm and attitudes by 5°, in directions drawn by the seed; the calibration
session is movement CAL of the same seed, the session judged is COMB of another one, method fused. Soft tissue is that of
both sessions. With `--wrong-mounts` every station file has both cameras 1° and 3 mm off, the true one as well.
"""

import argparse
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import FOLDER
from ghest_rt.calibration.arm_axis import ArmAxis
from ghest_rt.calibration.calibrate import calibrate
from ghest_rt.calibration.options import CalibrationOptions
from ghest_rt.calibration.session import session_of
from ghest_rt.calibration.station_text import rigid_rows
from ghest_rt.config.load import LoadedStation
from ghest_rt.config.station import Calibration
from ghest_rt.geometry.se3 import transform
from ghest_rt.geometry.so3 import Array, angle_between_rad, exp_so3
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.building import build_world
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.studies.observing.observed import Observed, observe
from ghest_rt.studies.observing.scenario import MountError
from ghest_rt.studies.session.estimating import estimate_session, with_mount_errors
from ghest_rt.studies.truth import TruthTrack

_ANOTHER = 100  # added to the seed of the calibration session
_VARIANTS = ("true", "spoilt", "calibrated", "calibrated, elbow by the exoskeleton")
_COLUMNS = ("centre m0 mm", "centre m1 mm", "attitude m0 °", "attitude m1 °", "GH rotation °", "elbow flexion °", "valid %")


def spoilt(station: LoadedStation, seed: int) -> LoadedStation:
    """Return the station with centres 15 mm and attitudes 5° off, and without what else a calibration has found."""
    rng = np.random.default_rng((seed, *b"spoilt"))

    def direction() -> Array:
        v = rng.standard_normal(3)
        return np.asarray(v / np.linalg.norm(v))

    def moved(rows: object) -> tuple[tuple[float, ...], ...]:
        pose = np.array(rows)
        return rigid_rows(transform(pose[:3, :3] @ exp_so3(math.radians(5.0) * direction()), pose[:3, 3] + 0.015 * direction()))

    old = station.config.calibration
    return with_(station, {"m0_from_gh": moved(old.m0_from_gh), "m1_from_elw": moved(old.m1_from_elw)})


def with_(station: LoadedStation, changes: dict[str, object]) -> LoadedStation:
    """Return the station with other values in its calibration."""
    calibration = Calibration.model_validate({**station.config.calibration.model_dump(), **changes})
    return replace(station, config=station.config.model_copy(update={"calibration": calibration}))


def with_wrong_mounts(station: LoadedStation, seed: int) -> LoadedStation:
    """Return the station with both camera mounts 1° and 3 mm off."""
    rng = np.random.default_rng((seed, *b"mounts"))

    def direction() -> tuple[float, float, float]:
        v = rng.standard_normal(3)
        x, y, z = (v / np.linalg.norm(v)).tolist()
        return x, y, z

    def off(size: float) -> tuple[float, float, float]:
        x, y, z = direction()
        return size * x, size * y, size * z

    errors = {camera: MountError(rotation_rad=off(math.radians(1.0)), translation_m=off(0.003)) for camera in ("r0", "r1")}
    return with_mount_errors(station, errors)


def calibrated(session: Observed, station: LoadedStation, options: CalibrationOptions) -> LoadedStation | None:
    """Return the station as `ghest-rt calibrate` leaves it; None if the session is refused."""
    estimates = estimate_session(replace(session, station=station), "photometric")
    outcome = calibrate(session_of(estimates, session.encoders, station, session.joints), station, options)
    for objection in outcome.objections:
        Console(stderr=True).print(objection.text)
    if outcome.objections or outcome.calibration is None:
        return None
    return with_(station, outcome.calibration.model_dump())


def judged(session: Observed, station: LoadedStation, arm_length_m: float) -> dict[str, float]:
    """Return how far a station file, and what `fused` makes of a session with it, are from the truth."""
    truth = TruthTrack.of(session.truth)
    estimates = estimate_session(replace(session, station=station), "fused")
    rotation, elbow, valid = [], [], 0
    for estimate in estimates:
        valid += estimate.status == "valid"
        true = truth.at(estimate.t_sample_ns)
        if true is None or estimate.gh_from_arm is None:
            continue
        rotation.append(angle_between_rad(true.gh_from_arm, estimate.gh_from_arm))
        if estimate.elbow is not None and true.elbow_rad is not None:
            elbow.append(estimate.elbow.flexion_rad - true.elbow_rad[0])
    right, said = session.station.config.calibration, station.config.calibration
    right_m0, said_m0, right_m1, said_m1 = map(
        np.array, (right.m0_from_gh, said.m0_from_gh, right.m1_from_elw, said.m1_from_elw)
    )
    length_m = arm_length_m if said.arm_length_m is None else said.arm_length_m
    centre = right_m1[:3, 3] + arm_length_m * right_m1[:3, 1], said_m1[:3, 3] + length_m * said_m1[:3, 1]
    values = (
        1000 * np.linalg.norm(said_m0[:3, 3] - right_m0[:3, 3]),
        1000 * np.linalg.norm(centre[1] - centre[0]),
        math.degrees(angle_between_rad(said_m0[:3, :3], right_m0[:3, :3])),
        math.degrees(angle_between_rad(said_m1[:3, :3], right_m1[:3, :3])),
        math.degrees(math.sqrt(np.mean(np.square(rotation)))),
        math.degrees(math.sqrt(np.mean(np.square(elbow)))),
        100 * valid / len(estimates),
    )
    return dict(zip(_COLUMNS, map(float, values), strict=True))


def run(sensor: str, seed: int, duration_s: float, soft_tissue: str, *, wrong_mounts: bool) -> dict[str, dict[str, float]]:
    """Return the figures of one sensor and seed by variant."""
    # Sensor and soft tissue are argparse's choices: the names that these options take, which a type checker cannot see.
    base = SimulateOptions(out=Path(), sensor=sensor, seed=seed)  # type: ignore[arg-type]
    world = build_world(replace(base, movement="CAL", soft_tissue=soft_tissue))  # type: ignore[arg-type]
    length_m = anatomy(base.height_m).upper_arm_m
    session = observe(world, ("photometric",))
    comb = replace(base, movement="COMB", seed=seed + _ANOTHER, duration_s=duration_s, soft_tissue=soft_tissue)  # type: ignore[arg-type]
    later = observe(build_world(comb), ("fused",))
    right = with_wrong_mounts(later.station, seed) if wrong_mounts else later.station
    bad = spoilt(right, seed)
    stations = {
        "true": right,
        "spoilt": bad,
        "calibrated": calibrated(session, bad, CalibrationOptions(calibration_id="new")),
        _VARIANTS[3]: calibrated(session, bad, CalibrationOptions(calibration_id="new", elbow_from=ArmAxis.EXOSKELETON)),
    }
    return {name: judged(later, station, length_m) for name, station in stations.items() if station is not None}


def main() -> None:
    """Judge, print, keep."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sensors", nargs="+", choices=("paper", "sr300"), default=("paper", "sr300"))
    parser.add_argument("--seeds", default="1,2,3", help="with commas between")
    parser.add_argument("--duration", type=float, default=8.0, help="seconds of COMB")
    parser.add_argument("--soft-tissue", choices=("none", "published", "severe"), default="none")
    parser.add_argument("--wrong-mounts", action="store_true", help="both cameras 1° and 3 mm off")
    arguments = parser.parse_args()
    table = Table("sensor", "seed", "station file", *_COLUMNS)
    rows = []
    for sensor in arguments.sensors:
        for seed in map(int, arguments.seeds.split(",")):
            results = run(sensor, seed, arguments.duration, arguments.soft_tissue, wrong_mounts=arguments.wrong_mounts)
            for variant, values in results.items():
                rows.append({"sensor": sensor, "seed": seed, "station": variant, **values})
                table.add_row(sensor, str(seed), variant, *(f"{value:.2f}" for value in values.values()))
    Console(width=150).print(table)
    FOLDER.mkdir(parents=True, exist_ok=True)
    summary = {"soft_tissue": arguments.soft_tissue, "wrong_mounts": arguments.wrong_mounts, "rows": rows}
    (FOLDER / "calibration.json").write_text(json.dumps(summary, indent=2) + "\n")


if __name__ == "__main__":
    main()
