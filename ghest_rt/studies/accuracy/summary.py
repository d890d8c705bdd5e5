"""Tables 5 and 6 from an accuracy study's rows: means over seeds with confidence intervals, the paper's values beside."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any, cast

import numpy as np

from ghest_rt.geometry.so3 import Array
from ghest_rt.simulation.therapy import find_movement
from ghest_rt.studies.accuracy.study import AccuracyPlan, Row, select
from ghest_rt.studies.checks import Check
from ghest_rt.studies.movements import MEAN_OF_MOVEMENTS
from ghest_rt.studies.numbers import finite, span_in_words
from ghest_rt.studies.paper_values import ACCURACY, MEAN, MOVEMENTS
from ghest_rt.studies.session.errors import POSE_QUANTITIES

_CONFIDENCE = 0.95
_WORDS = {
    "m0_m": "marker m0",
    "m1_m": "marker m1",
    "position_m": "position of the arm",
    "orientation_deg": "orientation of the arm",
}


def summarise(plan: AccuracyPlan, rows: Sequence[Row], cpu_s: float) -> dict[str, Any]:
    """Return the summary of a study's rows as JSON takes it; `cpu_s` is the processor time that they took."""
    entries = table(rows)
    return {
        "study": "accuracy",
        "seeds": list(plan.seeds),
        "duration_s": plan.movements.duration_s,
        "cpu_s": cpu_s,
        "table": entries,
        "checks": [asdict(check) for check in checks(entries, plan.movements.duration_s)],
    }


def table(rows: Sequence[Row]) -> list[Row]:
    """Return one entry per sensor, method, quantity and movement, and one for the mean of the movements.

    Each has `rms` (the mean over seeds), `rms_low` and `rms_high` (95 % confidence interval of that mean by Student's t over
    the seeds; None for one seed), `sd` and `valid_fraction` (means over seeds), `seeds`, and the paper's `paper_rms` and
    `paper_sd` (None for movements that are not the paper's, and for sensors that are not).
    """
    entries: list[Row] = []
    movements = list(dict.fromkeys(cast(str, row["movement"]) for row in rows))
    for sensor in dict.fromkeys(row["sensor"] for row in rows):
        for method in dict.fromkeys(row["method"] for row in rows):
            for quantity in POSE_QUANTITIES:
                chosen = [select(rows, sensor=sensor, method=method, quantity=quantity, movement=m) for m in movements]
                rms, sd, valid = ([_by_seed(of, column) for of in chosen] for column in ("rms", "sd", "valid_fraction"))
                whole = [*zip(movements, rms, sd, valid, strict=True)]
                if len(movements) > 1:
                    means = (np.mean(column, axis=0) for column in (rms, sd, valid))
                    whole.append((MEAN_OF_MOVEMENTS, *means))
                for movement, several, deviations, fractions in whole:
                    low, high = confidence_interval(several)
                    reported = ACCURACY[quantity].get(movement) if sensor == "paper" else None
                    paper_mean = MEAN[quantity] if sensor == "paper" and tuple(movements) == MOVEMENTS else None
                    entries.append(
                        {
                            "sensor": sensor,
                            "method": method,
                            "quantity": quantity,
                            "movement": movement,
                            "rms": finite(several.mean()),
                            "rms_low": low,
                            "rms_high": high,
                            "sd": finite(deviations.mean()),
                            "valid_fraction": finite(fractions.mean()),
                            "seeds": len(several),
                            "paper_rms": reported.rms if reported else paper_mean if movement == MEAN_OF_MOVEMENTS else None,
                            "paper_sd": reported.sd if reported else None,
                        }
                    )
    return entries


def confidence_interval(values: Array) -> tuple[float | None, float | None]:
    """Return the 95 % confidence interval of the mean of a few values by Student's t; (None, None) for fewer than two."""
    if len(values) < 2:
        return None, None
    from scipy.stats import t  # noqa: PLC0415 - an extra, imported only when used

    half = float(t.ppf(0.5 + _CONFIDENCE / 2, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values)))
    return finite(values.mean() - half), finite(values.mean() + half)


def checks(entries: Sequence[Row], duration_s: float | None = None) -> list[Check]:
    """Put the paper's statements on accuracy to the test, for method `paper` with the paper's sensor and movements.

    They are of whole movements: where only the first `duration_s` of them were played, nothing is judged.
    """
    rms = _of_method(entries, "paper")
    if not all((quantity, movement) in rms for quantity in POSE_QUANTITIES for movement in MOVEMENTS):
        return []
    found = [_m1_is_worse(rms, _of_method(entries, "refined")), *_comb_is_worst(rms)]
    if duration_s is None or all(duration_s >= find_movement(name).duration_s for name in MOVEMENTS):
        return found
    played = f"Not judged: only the {span_in_words(duration_s)} was played, and the statement is of whole movements. "
    return [replace(check, holds=None, explanation=played + check.explanation) for check in found]


def _of_method(entries: Sequence[Row], method: str) -> dict[tuple[str, str], float]:
    return {
        (cast(str, e["quantity"]), cast(str, e["movement"])): cast(float, e["rms"])
        for e in entries
        if e["sensor"] == "paper" and e["method"] == method and e["rms"] is not None
    }


def _m1_is_worse(rms: dict[tuple[str, str], float], refined: dict[tuple[str, str], float]) -> Check:
    def pairs(of: dict[tuple[str, str], float]) -> str:
        return "; ".join(
            f"{m}: m0 {_shown('m0_m', of['m0_m', m])}, m1 {_shown('m1_m', of['m1_m', m])}"
            for m in MOVEMENTS
            if ("m1_m", m) in of
        )

    known = [m for m in MOVEMENTS if ("m0_m", m) in refined and ("m1_m", m) in refined]
    without_offset = bool(known) and all(refined["m1_m", m] > refined["m0_m", m] for m in known)
    return Check(
        "Marker m1 is found less accurately than m0, in every movement (section 4.1, Table 5)",
        all(rms["m1_m", m] > rms["m0_m", m] for m in MOVEMENTS),
        pairs(rms) + (f"; by method refined {pairs(refined)}" if refined else ""),
        "What m1 has and m0 has not is a camera on the moving exoskeleton, whose place rests on the encoder sample nearest in "
        "time, up to half a period off: that costs most where the exoskeleton moves most, in COMB. Where it moves little, the "
        "offset of bounding-box centres on the pixel grid decides, which is near a millimetre for either marker and may be the "
        "larger for m0." + (" Method refined, without that offset, shows what the paper states." if without_offset else ""),
    )


def _comb_is_worst(rms: dict[tuple[str, str], float]) -> list[Check]:
    reasons = {
        "marker m1 and the arm": (
            ("m1_m", "position_m", "orientation_deg"),
            "The largest and fastest movement: markers are seen at steeper angles, and an offset in time costs more. That "
            "takes the whole movement: in its first seconds COMB is not yet as large, nor as fast.",
        ),
        "marker m0": (
            ("m0_m",),
            "Marker m0 is on the acromion and hardly moves in any movement: what decides is where on the pixel grid its disks "
            "lie. A movement that carries them over more pixels averages over offsets, as COMB does.",
        ),
    }
    found = []
    for what, (quantities, reason) in reasons.items():
        worst = {quantity: max(MOVEMENTS, key=lambda m, q=quantity: rms[q, m]) for quantity in quantities}  # type: ignore[misc]
        figures = "; ".join(
            f"{_WORDS[q]}: {', '.join(f'{m} {_shown(q, rms[q, m])}' for m in MOVEMENTS)}, worst {worst[q]}" for q in quantities
        )
        name = f"COMB is the worst movement for {what} (Tables 5 and 6)"
        found.append(Check(name, all(movement == "COMB" for movement in worst.values()), figures, reason))
    return found


def _by_seed(rows: Sequence[Row], column: str) -> Array:
    return np.array([np.nan if row[column] is None else row[column] for row in rows], dtype=np.float64)


def _shown(quantity: str, value: float) -> str:
    return f"{value:.3g}°" if quantity.endswith("_deg") else f"{1e3 * value:.3g} mm"
