"""Errors of GH angles: as a rotation (exponential map, 3.4.2) and angle by angle, also judged when an answer is published."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ghest_rt.estimation.angles import clinical, euler_yxz
from ghest_rt.geometry.so3 import Array, angle_between_rad
from ghest_rt.messages.results import GhEstimate, TruthSample
from ghest_rt.studies.truth import TruthTrack

ANGLES = ("flexion_deg", "abduction_deg", "rotation_deg")
ANGLE_QUANTITIES = ("orientation_deg", "published_deg", *ANGLES, "plane_deg")
"""What is judged: the rotation at the sample's own instant; the same when it is published, `lag` later; the clinical angles;
the plane of shoulder, elbow and wrist (what the swivel angle tells)."""


"""By the name that the benchmarks know."""


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """What a method said at the instants of the grid.

    Attributes:
        t_ns: The instants.
        gh_from_arm: At each the (3, 3) rotation, or None.
        lag_ns: How long after its instant an answer is published.
    """

    t_ns: Sequence[int]
    gh_from_arm: Sequence[Array | None]
    lag_ns: int

    @classmethod
    def of(cls, estimates: Sequence[GhEstimate], lag_ns: int) -> "Answers":
        """Return the answers in estimates."""
        return cls([e.t_sample_ns for e in estimates], [e.gh_from_arm for e in estimates], lag_ns)


def error_columns(answers: Answers, truth: TruthTrack) -> dict[str, Array]:
    """Return each of `ANGLE_QUANTITIES` at every instant, degrees.

    Each is (n,), signed for the angles, NaN where there is nothing to judge. Single angles are not judged where the true
    posture is within 10 degrees of their singularity.
    """
    rows = [
        _errors(rotation, truth.at(t_ns), truth.at(t_ns + answers.lag_ns))
        for t_ns, rotation in zip(answers.t_ns, answers.gh_from_arm, strict=True)
    ]
    table = np.array(rows, dtype=np.float64).reshape(-1, len(ANGLE_QUANTITIES))
    return {name: table[:, k] for k, name in enumerate(ANGLE_QUANTITIES)}


def error_statistics(answers: Answers, truth: TruthTrack) -> dict[str, float | int]:
    """Return the root mean square of each of `ANGLE_QUANTITIES`, the greatest orientation error and how much was judged."""
    columns = error_columns(answers, truth)
    known = np.array([truth.at(t_ns) is not None for t_ns in answers.t_ns], dtype=bool)
    orientation = columns["orientation_deg"]
    answered = int(np.isfinite(orientation).sum())
    return {
        **{name: _rms(values) for name, values in columns.items()},
        "max_deg": float(np.nanmax(orientation)) if answered else math.nan,
        "samples": int(known.sum()),
        "answered_fraction": answered / max(1, int(known.sum())),
        "angles_judged_fraction": int(np.isfinite(columns["flexion_deg"]).sum()) / max(1, answered),
    }


def on_common_instants(theirs: Answers, fused: Answers, truth: TruthTrack) -> dict[str, float]:
    """Return what two contenders are off by where both have an answer, so that silence in hard moments wins nothing.

    Returns:
        `common_fraction`, the share of the instants with truth at which both answered; for each of `ANGLE_QUANTITIES` its root
        mean square there as `common_<quantity>` for the one and `fused_common_<quantity>` for the other.
    """
    known = {t_ns for t_ns in theirs.t_ns if truth.at(t_ns) is not None}
    columns = error_columns(theirs, truth), error_columns(fused, truth)
    at = {t_ns: k for k, t_ns in enumerate(fused.t_ns)}
    shared = [(k, at[t_ns]) for k, t_ns in enumerate(theirs.t_ns) if t_ns in at]
    mine, others = ([pair[side] for pair in shared] for side in (0, 1))
    found: dict[str, float] = {}
    for name in ANGLE_QUANTITIES:
        one, other = columns[0][name][mine], columns[1][name][others]
        both = np.isfinite(one) & np.isfinite(other)
        found[f"common_{name}"], found[f"fused_common_{name}"] = _rms(one[both]), _rms(other[both])
        if name == "orientation_deg":
            found["common_fraction"] = int(both.sum()) / max(1, len(known))
    return found


def girdle_turn_deg(truth: Sequence[TruthSample]) -> float:
    """Return by how much the scapula turns in E, RMS against the neutral posture: what no encoder of the exoskeleton sees."""
    turns = [math.degrees(angle_between_rad(t.e_from_arm[:3, :3], t.gh_from_arm)) for t in truth]
    return _rms(np.array(turns))


def simple_forecasts_deg(truth: TruthTrack, instants_ns: Sequence[int], period_ns: int) -> dict[str, float]:
    """Return how far off two simple forecasts are that know the truth exactly, but only up to one image ago; RMS.

    They tell how much of a movement can be foreseen from one image to the next: `hold_forecast_deg` keeps the rotation of a
    period ago, `straight_forecast_deg` continues it at its mean rate of the period before.
    """
    held, straight = [], []
    for t_ns in instants_ns:
        now, newest, before = (truth.at(t_ns - k * period_ns) for k in range(3))
        if now is not None and newest is not None and before is not None:
            on = newest.gh_from_arm @ before.gh_from_arm.T @ newest.gh_from_arm
            held.append(math.degrees(angle_between_rad(now.gh_from_arm, newest.gh_from_arm)))
            straight.append(math.degrees(angle_between_rad(now.gh_from_arm, on)))
    return {"hold_forecast_deg": _rms(np.array(held)), "straight_forecast_deg": _rms(np.array(straight))}


def _errors(rotation: Array | None, at: TruthSample | None, published: TruthSample | None) -> list[float]:
    if rotation is None or at is None:
        return [math.nan] * len(ANGLE_QUANTITIES)
    true = at.gh_from_arm
    late = math.nan if published is None else math.degrees(angle_between_rad(published.gh_from_arm, rotation))
    cosine = float(np.clip(rotation[:, 0] @ true[:, 0], -1.0, 1.0))
    return [
        math.degrees(angle_between_rad(true, rotation)),
        late,
        *_angle_errors_deg(rotation, true),
        math.degrees(math.acos(cosine)),
    ]


def _angle_errors_deg(rotation: Array, true: Array) -> list[float]:
    said, meant = clinical(euler_yxz(rotation), "right"), clinical(euler_yxz(true), "right")
    if meant.near_singularity:
        return [math.nan] * len(ANGLES)
    differences = (
        said.flexion_rad - meant.flexion_rad,
        said.abduction_rad - meant.abduction_rad,
        said.rotation_rad - meant.rotation_rad,
    )
    return [math.degrees(math.remainder(d, 2.0 * math.pi)) for d in differences]


def _rms(values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(finite)))) if finite.size else math.nan
