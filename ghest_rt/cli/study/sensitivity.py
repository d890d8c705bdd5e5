"""`ghest-rt study sensitivity`: equations (11)-(13), Tables 3-4, Figures 14-17, and beyond."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ghest_rt.cli.options import Json, Sensor
from ghest_rt.cli.study.options import (
    Duration,
    Methods,
    Motions,
    Movements,
    Out,
    Scheduler,
    Seed,
    Workers,
    chosen_methods,
    movements_of,
)
from ghest_rt.extras import need_extra

if TYPE_CHECKING:
    from rich.console import Console

_SOBOL_SAMPLES = 256
_QUICK_SOBOL_SAMPLES = 16


def sensitivity(
    out: Out = Path("out/study"),
    sensor: Annotated[Sensor, typer.Option(help="Which sensor")] = Sensor.PAPER,
    method: Methods = None,
    movement: Movements = None,
    motion: Motions = None,
    seed: Seed = 1,
    duration: Duration = None,
    paper_only: Annotated[
        bool,
        typer.Option("--paper-only", metavar="", help="Only what the paper did: q1 to q6, no turns, mounts, encoders, Sobol"),
    ] = False,
    sobol_samples: Annotated[
        int | None,
        typer.Option(
            min=4,
            metavar="N",
            help=f"Base samples of the Sobol indices, a power of two. By default {_SOBOL_SAMPLES}, "
            f"with --quick {_QUICK_SOBOL_SAMPLES}",
            show_default=False,
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            metavar="",
            help="A small version, to see that it works: 2 s of each movement, fewer amounts; what is named counts",
        ),
    ] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """Errors and relative sensitivities as markers shift (Figures 14-17), turn, and as the calibration is wrong."""
    from ghest_rt.cli.study.running import finish, opened, shown_progress

    need_extra("study", "a study")
    from ghest_rt.studies.figures.sensitivity import figures
    from ghest_rt.studies.results import write_study
    from ghest_rt.studies.sensitivity.sobol import check_samples, run_sobol
    from ghest_rt.studies.sensitivity.study import PAPER_SHIFTS_M, QUICK, QUICK_SHIFTS_M, SensitivityPlan, run_sensitivity
    from ghest_rt.studies.sensitivity.summary import summarise

    samples = sobol_samples or (_QUICK_SOBOL_SAMPLES if quick else _SOBOL_SAMPLES)
    check_samples(samples)
    plan = SensitivityPlan(
        movements=movements_of(movement, motion, duration, QUICK if quick else None),
        sensor=sensor.value,
        seed=seed,
        methods=chosen_methods(method),
        shifts_m=QUICK_SHIFTS_M if quick else PAPER_SHIFTS_M,
        further=not paper_only,
        every_amount=not quick,
    )
    store, runs_on = opened(out, workers, scheduler)
    with shown_progress("study sensitivity") as progress:
        rows, cpu_s = run_sensitivity(plan, store, runs_on, progress)
    indices: list[dict[str, object]] = []
    if plan.further:
        bases = plan.movements.scenarios(plan.sensor, plan.seed, plan.methods)
        with shown_progress("Sobol indices") as progress:
            indices = run_sobol(bases, samples, store, runs_on, progress)
    summary = summarise(plan, rows, indices, samples, cpu_s)
    document = write_study(out, summary, {"rows": rows, "sobol": indices}, figures(summary))
    finish(document, out, as_json, _show)


def _show(document: dict[str, Any], console: "Console") -> None:
    from ghest_rt.cli.study.running import new_table, show_checks
    from ghest_rt.studies.numbers import number

    shown = new_table(
        "Arm's RMS error at the largest amount, mean over movements; relative sensitivity S, eq. (11)",
        ("method", "parameter", "amount"),
        ("position\nmm", "orient.\n°", "S\nposition", "S\norient."),
    )
    for row in document["at_largest"]:
        amount = f"{row['amount']:g}°" if row["unit"] == "deg" else f"{1e3 * row['amount']:g} mm"
        place = f" ({row['what']} {row['axis']})" if row["group"] == "shift" else ""
        shown.add_row(
            row["method"],
            row["parameter"].replace("_", " ") + place,
            amount,
            number(row["position_m_rms"], 1e3),
            number(row["orientation_deg_rms"]),
            number(row["S_position"]),
            number(row["S_orientation"]),
        )
    console.print(shown)
    show_checks(document, console)
