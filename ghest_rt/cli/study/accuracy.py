"""`ghest-rt study accuracy`: Tables 5 and 6 and Figure 13."""

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
    Workers,
    chosen_methods,
    chosen_sensors,
    movements_of,
)
from ghest_rt.extras import need_extra

if TYPE_CHECKING:
    from rich.console import Console

_TITLES = {"m0_m": "m0\nmm", "m1_m": "m1\nmm", "position_m": "arm\nmm", "orientation_deg": "arm\n°"}


def accuracy(
    out: Out = Path("out/study"),
    sensor: Annotated[
        list[Sensor] | None,
        typer.Option(
            "--sensor",
            help="Which sensor; again for more. By default both, with --quick the paper's",
            show_default=False,
        ),
    ] = None,
    method: Methods = None,
    movement: Movements = None,
    motion: Motions = None,
    seeds: Annotated[
        int | None,
        typer.Option(
            "--seeds",
            min=1,
            metavar="N",
            help="Repeat with so many seeds. By default 3, for confidence intervals, with --quick 2",
            show_default=False,
        ),
    ] = None,
    duration: Duration = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            metavar="",
            help="A small version, to see that it works: 2 s of each movement, one sensor, two seeds; what is named counts",
        ),
    ] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """Errors of the markers' and the arm's pose per movement: Tables 5 and 6, Figure 13.

    Example: [bold]ghest-rt study accuracy --sensor paper --seeds 1[/]
    """
    from ghest_rt.cli.study.running import finish, opened, shown_progress

    need_extra("study", "a study")
    from ghest_rt.studies.accuracy.study import QUICK, AccuracyPlan, run_accuracy
    from ghest_rt.studies.accuracy.summary import summarise
    from ghest_rt.studies.figures.accuracy import figures
    from ghest_rt.studies.results import write_study

    plan = AccuracyPlan(
        movements=movements_of(movement, motion, duration, QUICK if quick else None),
        sensors=chosen_sensors(sensor, ("paper",) if quick else ("paper", "sr300")),
        methods=chosen_methods(method),
        seeds=tuple(range(1, (seeds or (2 if quick else 3)) + 1)),
    )
    store, runs_on = opened(out, workers, scheduler)
    with shown_progress("study accuracy") as progress:
        rows, cpu_s = run_accuracy(plan, store, runs_on, progress)
    summary = summarise(plan, rows, cpu_s)
    document = write_study(out, summary, {"rows": rows, "table": summary["table"]}, figures(rows, plan.movements.duration_s))
    finish(document, out, as_json, _show)


def _show(document: dict[str, Any], console: "Console") -> None:
    from ghest_rt.cli.study.running import new_table, show_checks
    from ghest_rt.studies.numbers import number, percent

    shown = new_table(
        "RMS errors, mean over seeds, ± half its 95 % confidence interval",
        ("sensor: method", "movement"),
        (*_TITLES.values(), "valid\n%"),
    )
    by_place: dict[tuple[str, str, str], dict[str, dict[str, Any]]] = {}
    for e in document["table"]:
        by_place.setdefault((e["sensor"], e["method"], e["movement"]), {})[e["quantity"]] = e
    reported: dict[str, dict[str, dict[str, Any]]] = {}
    for (sensor, method, movement), of in by_place.items():
        valid = percent(of["orientation_deg"]["valid_fraction"])
        shown.add_row(f"{sensor}: {method}", movement, *(_cell(of[q], q) for q in _TITLES), valid)
        if any(e["paper_rms"] is not None for e in of.values()):
            reported[movement] = of
    if reported:
        shown.add_section()
    for movement, of in reported.items():
        shown.add_row("as published", movement, *(number(of[q]["paper_rms"], _scale(q)) for q in _TITLES), "")
    console.print(shown)
    show_checks(document, console)


def _cell(entry: dict[str, Any], quantity: str) -> str:
    from ghest_rt.studies.numbers import number

    text = number(entry["rms"], _scale(quantity))
    if entry["rms_low"] is None:
        return text
    return f"{text}\n±{number((entry['rms_high'] - entry['rms_low']) / 2, _scale(quantity))}"


def _scale(quantity: str) -> float:
    return 1.0 if quantity.endswith("_deg") else 1e3
