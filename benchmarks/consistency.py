"""Does the filter's stated uncertainty hold? NEES, NIS and the share of 95 % intervals that contain the truth.

`python -m benchmarks.consistency [--tuning] [--reference] [--only TEXT] [--seeds 101,102,103]` from the project's root judges
`fused` on simulated sessions of all conditions (benchmarks/conditions.py); sessions are simulated once and kept in
out/benchmarks/. With `--reference` every one has a `[calibration.reference]` of its own, with errors drawn from its tolerances.
"""

import argparse
import json
import math
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.conditions import HELD_OUT_SEEDS, TUNING_SEEDS, Condition, conditions
from benchmarks.consistency_picture import HISTOGRAM_EDGES, draw
from benchmarks.filter_tick import estimator_for
from benchmarks.observed import estimates, observed
from benchmarks.scenes import FOLDER
from ghest_drivers.samples import EncoderSample
from ghest_rt.estimation.angles import euler_yxz
from ghest_rt.estimation.fused.estimator import FusedEstimator
from ghest_rt.estimation.uncertainty import euler_sigma_rad
from ghest_rt.geometry.so3 import Array, log_so3
from ghest_rt.messages.results import MarkerObservation, Status

_QUANTILE = 1.959964


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """One session.

    Attributes:
        condition: Its condition.
        seed: Its seed.
        error_rad: (k, 3) rotation errors of the samples that have angles.
        inside: (k, 3) whether the 95 % interval of flexion, abduction, rotation holds the truth.
        nees: (k,) normalised estimation error squared, 3 degrees of freedom.
        nis: (n,) normalised innovations squared, 6 degrees of freedom.
        valid: Share of all samples that are `valid`.
    """

    condition: Condition
    seed: int
    error_rad: Array
    inside: Array
    nees: Array
    nis: Array
    valid: float

    @property
    def rms_deg(self) -> float:
        """RMS of the rotation error."""
        return math.degrees(math.sqrt(float(np.mean(np.sum(np.square(self.error_rad), axis=1)))))


class _Listening:
    """A fused estimator whose innovations are kept."""

    def __init__(self, estimator: FusedEstimator) -> None:
        self._estimator = estimator
        self.nis: list[float] = []
        self.add_encoder = estimator.add_encoder
        self.estimate = estimator.estimate
        self.counts = estimator.counts

    def add_marker(self, observation: MarkerObservation) -> None:
        self._estimator.add_marker(observation)
        found = self._estimator.innovation(observation.t_capture_ns)
        if observation.camera_from_marker is not None and found is not None:
            self.nis.append(found)

    def add(self, sample: MarkerObservation | EncoderSample) -> None:
        if isinstance(sample, MarkerObservation):
            self.add_marker(sample)
        else:
            self.add_encoder(sample)


def judge(condition: Condition, seed: int, *, reference: bool) -> Judged:
    """Run one session through the filter, each instant as it would have been published."""
    calibration = f"{condition.group}: {condition.name}" if reference else None
    session = observed(condition.seeded(seed), condition.vision, reference=calibration)
    estimator = estimator_for(session, "fused")
    if not isinstance(estimator, FusedEstimator):
        raise TypeError("method fused is made of something else")
    listening = _Listening(estimator)
    errors, inside, nees, valid = [], [], [], []
    for found in estimates(session, listening, 0):
        truth = session.truth.at(found.t_sample_ns)
        valid.append(found.status is Status.VALID)
        if found.gh_from_arm is None or found.covariance is None or truth is None:
            continue
        error = log_so3(truth.gh_from_arm @ found.gh_from_arm.T)
        apart = _angles(truth.gh_from_arm) - _angles(found.gh_from_arm)
        apart -= 2.0 * math.pi * np.rint(apart / (2.0 * math.pi))
        errors.append(error)
        inside.append(np.abs(apart) <= _QUANTILE * np.array(euler_sigma_rad(found.gh_from_arm, found.covariance)))
        nees.append(float(error @ np.linalg.solve(found.covariance, error)))
    return Judged(
        condition, seed, np.array(errors), np.array(inside), np.array(nees), np.array(listening.nis), float(np.mean(valid))
    )


def _angles(gh_from_arm: Array) -> Array:
    euler = euler_yxz(gh_from_arm)
    return np.array([euler.a_rad, euler.b_rad, euler.g_rad])


def main() -> None:
    """Judge, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tuning", action="store_true", help="the seeds that the filter was tuned with, not the held-out ones")
    parser.add_argument("--seeds", help="these seeds, with commas between")
    parser.add_argument("--reference", action="store_true", help="station files with [calibration.reference]")
    parser.add_argument("--only", default="", help="conditions whose group or name contains this")
    arguments = parser.parse_args()
    seeds = TUNING_SEEDS if arguments.tuning else HELD_OUT_SEEDS
    if arguments.seeds:
        seeds = tuple(int(seed) for seed in arguments.seeds.split(","))
    chosen = [c for c in conditions() if arguments.only in f"{c.group}: {c.name}"]
    console = Console(width=120)
    found: list[Judged] = []
    with ProcessPoolExecutor(2) as pool:
        for seed in seeds:
            runs = pool.map(partial(judge, seed=seed, reference=arguments.reference), chosen)
            found += track(runs, f"seed {seed}", total=len(chosen), console=Console(stderr=True))
    console.print(_table(found))
    summary = {"seeds": list(seeds), "reference": arguments.reference, **_summary(found)}
    console.print_json(data=summary)
    FOLDER.mkdir(parents=True, exist_ok=True)
    drawn = {"conditions": _conditions(found), "histograms": _histograms(found)}
    (FOLDER / "consistency.json").write_text(json.dumps({**summary, **drawn}, indent=2) + "\n")
    draw(**drawn, out=FOLDER / "consistency.png")
    console.print(f"picture: {FOLDER / 'consistency.png'}")


def _by_condition(found: list[Judged]) -> dict[tuple[str, str], list[Judged]]:
    grouped: dict[tuple[str, str], list[Judged]] = {}
    for judged in found:
        grouped.setdefault((judged.condition.group, judged.condition.name), []).append(judged)
    return grouped


def _summary(found: list[Judged]) -> dict[str, object]:
    groups: dict[str, list[Judged]] = {"all": found}
    for judged in found:
        groups.setdefault(judged.condition.group, []).append(judged)
    return {
        group: {
            "coverage_percent": round(100.0 * float(np.mean(np.concatenate([j.inside for j in members]))), 2),
            "nees_per_dof_median": round(float(np.median([np.mean(j.nees) for j in members])) / 3.0, 2),
            "nis_per_dof": round(float(np.mean(np.concatenate([j.nis for j in members]))) / 6.0, 2),
            "mean_rms_deg": round(float(np.mean([j.rms_deg for j in members])), 3),
        }
        for group, members in groups.items()
    }


def _table(found: list[Judged]) -> Table:
    angles = ("flexion, %", "abduction, %", "rotation, %")
    table = Table("group", "condition", "RMS, °", "NEES / 3", "NIS / 6", *angles, "valid, %")
    for (group, name), members in _by_condition(found).items():
        inside = 100.0 * np.concatenate([j.inside for j in members]).mean(axis=0)
        table.add_row(
            group,
            name,
            f"{np.mean([j.rms_deg for j in members]):.3f}",
            f"{np.mean(np.concatenate([j.nees for j in members])) / 3.0:.2f}",
            f"{np.mean(np.concatenate([j.nis for j in members])) / 6.0:.2f}",
            *(f"{share:.1f}" for share in inside),
            f"{100.0 * np.mean([j.valid for j in members]):.0f}",
        )
    return table


def _conditions(found: list[Judged]) -> list[dict[str, object]]:
    """Return the coverage of every condition, as JSON takes it."""
    return [
        {
            "group": group,
            "title": members[0].condition.title,
            "coverage_percent": (100.0 * np.concatenate([j.inside for j in members]).mean(axis=0)).round(2).tolist(),
        }
        for (group, _), members in _by_condition(found).items()
    ]


def _histograms(found: list[Judged]) -> dict[str, list[float]]:
    """Return how NEES and NIS of the undisturbed sessions, or of all if there is none, are distributed."""
    plain = [j for j in found if j.condition.group == "plain"] or found
    values = {"nees": np.concatenate([j.nees for j in plain]), "nis": np.concatenate([j.nis for j in plain])}
    return {
        name: np.histogram(np.minimum(of, HISTOGRAM_EDGES[-1]), HISTOGRAM_EDGES, density=True)[0].round(5).tolist()
        for name, of in values.items()
    }


if __name__ == "__main__":
    main()
