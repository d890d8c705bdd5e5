"""Markers on soft tissue: `paper`, `refined` and `fused` beside the exoskeleton's joints alone, on the same sessions.

`python -m benchmarks.soft_tissue [--seeds 1] [--duration 6] [--reference]` from the project's root; soft tissue of published
magnitude (docs/disturbances.md), the paper's sensors. The exoskeleton alone looks at no marker: its cuffs do not slip here.
With `--reference` the station files have a `[calibration.reference]`.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import FOLDER
from ghest_rt.estimation.pipeline import lag_ns_of
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.calibrating import with_reference
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.studies.observing.observed import observe
from ghest_rt.studies.observing.scenario import Scenario
from ghest_rt.studies.rivals.angle_errors import ANGLES, Answers, error_statistics
from ghest_rt.studies.rivals.running import run_without_cameras
from ghest_rt.studies.session.estimating import estimate_session
from ghest_rt.studies.truth import TruthTrack
from ghest_rt.vision.station import Method

_MOVEMENTS = ("SFE", "SAbAd", "SIR", "COMB")
_METHODS: tuple[Method, ...] = ("paper", "refined", "fused")
_COLUMNS = ("orientation_deg", *ANGLES)


def judged(movement: str, seed: int, duration_s: float, *, reference: bool) -> dict[str, dict[str, float]]:
    """Return the error statistics of a session by contender, degrees."""
    scenario = Scenario(movement=movement, seed=seed, duration_s=duration_s, soft_tissue="published", methods=_METHODS)
    session = observe(scenario.world(), _METHODS)
    if reference:
        body = anatomy(SimulateOptions(out=Path()).height_m)
        session = replace(session, station=with_reference(session.station, body, seed, movement))
    answers = {
        method: Answers.of(estimate_session(session, method), lag_ns_of(session.station.config, method)) for method in _METHODS
    }
    instants_ns = answers["refined"].t_ns
    answers["exoskeleton"] = run_without_cameras(session, scenario.sensor, seed, instants_ns)["exoskeleton"]
    truth = TruthTrack.of(session.truth)
    return {key: {name: error_statistics(said, truth)[name] for name in _COLUMNS} for key, said in answers.items()}


def main() -> None:
    """Judge, print, keep."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", default="1", help="with commas between")
    parser.add_argument("--duration", type=float, default=6.0, help="seconds of each movement")
    parser.add_argument("--reference", action="store_true", help="station files with [calibration.reference]")
    arguments = parser.parse_args()
    seeds = [int(seed) for seed in arguments.seeds.split(",")]
    table = Table("movement", "method", "rotation, RMS °", "flexion", "abduction", "internal rotation")
    rows = []
    for movement in _MOVEMENTS:
        sessions = [judged(movement, seed, arguments.duration, reference=arguments.reference) for seed in seeds]
        for key in sessions[0]:
            means = {name: float(np.mean([session[key][name] for session in sessions])) for name in _COLUMNS}
            rows.append({"movement": movement, "method": key, **means})
            table.add_row(movement, key, *(f"{value:.2f}" for value in means.values()))
    Console(width=110).print(table)
    FOLDER.mkdir(parents=True, exist_ok=True)
    summary = {"seeds": seeds, "reference": arguments.reference, "rows": rows}
    (FOLDER / "soft_tissue.json").write_text(json.dumps(summary, indent=2) + "\n")


if __name__ == "__main__":
    main()
