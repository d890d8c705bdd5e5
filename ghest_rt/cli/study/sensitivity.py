"""`ghest-rt study sensitivity`: equations (11)-(13), Tables 3-4, Figures 14-17, and beyond."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ghest_rt.cli.options import Json, Sensor
from ghest_rt.cli.study.options import Duration, Methods, Motions, Movements, Out, Quick, Scheduler, Workers
from ghest_rt.extras import need_extra

_QUICK_SOBOL_SAMPLES = 16


def sensitivity(
    out: Out = Path("out/study"),
    sensor: Annotated[Sensor, typer.Option(help="Which sensor")] = Sensor.PAPER,
    method: Methods = None,
    movement: Movements = None,
    motion: Motions = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Of the simulation")] = 1,
    duration: Duration = None,
    paper_only: Annotated[
        bool,
        typer.Option("--paper-only", metavar="", help="Only what the paper did: q1 to q6, no turns, mounts, encoders, Sobol"),
    ] = False,
    sobol_samples: Annotated[
        int, typer.Option(min=4, metavar="N", help="Base samples of the Sobol indices, a power of two")
    ] = 256,
    quick: Quick = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """Errors and relative sensitivities as markers shift (Figures 14-17), turn, and as the calibration is wrong."""
    from ghest_rt.cli.study.running import executor, shown_progress, store_in

    need_extra("study", "a study")
    from ghest_rt.cli.study.options import chosen_methods
    from ghest_rt.studies.engine.tables import write_summary, write_tables
    from ghest_rt.studies.figures.sensitivity import save_all
    from ghest_rt.studies.movements import Movements as MovementsOf
    from ghest_rt.studies.sensitivity.sobol import RANGES, check_samples, run_sobol
    from ghest_rt.studies.sensitivity.study import (
        PAPER_SHIFTS_M,
        QUICK_DURATION_S,
        QUICK_SHIFTS_M,
        SensitivityPlan,
        run_sensitivity,
    )
    from ghest_rt.studies.sensitivity.summary import summarise

    samples = _QUICK_SOBOL_SAMPLES if quick else sobol_samples
    check_samples(samples)
    plan = SensitivityPlan(
        movements=MovementsOf(
            tuple(m.value for m in movement or ()), tuple(motion or ()), duration or (QUICK_DURATION_S if quick else None)
        ),
        sensor=sensor.value,
        seed=seed,
        methods=chosen_methods(method),
        shifts_m=QUICK_SHIFTS_M if quick else PAPER_SHIFTS_M,
        further=not paper_only,
        every_amount=not quick,
    )
    store, runs_on = store_in(out), executor(workers, scheduler)
    with shown_progress("study sensitivity") as progress:
        rows, cpu_s = run_sensitivity(plan, store, runs_on, progress)
    indices: list[dict[str, object]] = []
    if plan.further:
        bases = plan.movements.scenarios(plan.sensor, plan.seed, plan.methods)
        with shown_progress("Sobol indices") as progress:
            indices = run_sobol(bases, samples, store, runs_on, progress)
    folder = out / "sensitivity"
    write_tables(rows, folder, "rows")
    if indices:
        write_tables(indices, folder, "sobol")
    save_all(rows, indices, folder / "figures")
    document: dict[str, object] = {
        "study": "sensitivity",
        "sensor": plan.sensor,
        "seed": seed,
        "duration_s": plan.movements.duration_s,
        "cpu_s": cpu_s,
        **summarise(rows),
        "sobol": {"samples": samples, "ranges": RANGES, "indices": indices},
        "rows": rows,
    }
    write_summary(document, folder)
    if as_json:
        from ghest_rt.cli.console import print_json

        print_json(document)
    else:
        _show(document, folder)


def _show(document: dict[str, Any], folder: Path) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from ghest_rt.cli.study.running import show_end

    shown = Table(
        title="Arm's RMS error at the largest amount, mean over movements; relative sensitivity S, eq. (11)",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    for column in ("method", "parameter", "amount"):
        shown.add_column(column, no_wrap=True)
    for column in ("position\nmm", "orient.\n°", "S\nposition", "S\norient."):
        shown.add_column(column, justify="right")
    for row in document["at_largest"]:
        amount = f"{row['amount']:g}°" if row["unit"] == "deg" else f"{1e3 * row['amount']:g} mm"
        cells = (
            _number(row["position_m_rms"], 1e3),
            _number(row["orientation_deg_rms"], 1.0),
            _number(row["S_position"], 1.0),
            _number(row["S_orientation"], 1.0),
        )
        place = f" ({row['what']} {row['axis']})" if row["group"] == "shift" else ""
        shown.add_row(row["method"], row["parameter"].replace("_", " ") + place, amount, *cells)
    console = Console()
    console.print(shown)
    show_end(console, document, folder)


def _number(value: float | None, scale: float) -> str:
    return "-" if value is None else f"{scale * value:.3f}"
