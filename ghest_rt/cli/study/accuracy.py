"""`ghest-rt study accuracy`: Tables 5 and 6 and Figure 13."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ghest_rt.cli.options import Json, Sensor
from ghest_rt.cli.study.options import Duration, Methods, Motions, Movements, Out, Quick, Scheduler, Workers
from ghest_rt.extras import need_extra

_QUICK_DURATION_S = 2.0
_TITLES = {"m0_m": "m0\nmm", "m1_m": "m1\nmm", "position_m": "arm\nmm", "orientation_deg": "arm\n°"}


def accuracy(
    out: Out = Path("out/study"),
    sensor: Annotated[list[Sensor] | None, typer.Option(help="Only this sensor; again for more", show_default=False)] = None,
    method: Methods = None,
    movement: Movements = None,
    motion: Motions = None,
    seeds: Annotated[int, typer.Option(min=1, metavar="N", help="Repeat with so many seeds, for confidence intervals")] = 3,
    duration: Duration = None,
    quick: Quick = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """Errors of the markers' and the arm's pose per movement: Tables 5 and 6, Figure 13."""
    from dataclasses import asdict

    from ghest_rt.cli.study.running import executor, shown_progress, store_in

    need_extra("study", "a study")
    from ghest_rt.cli.study.options import chosen_methods
    from ghest_rt.studies.accuracy.study import AccuracyPlan, run_accuracy
    from ghest_rt.studies.accuracy.summary import checks, table
    from ghest_rt.studies.engine.tables import write_summary, write_tables
    from ghest_rt.studies.figures.accuracy import draw_figure_13
    from ghest_rt.studies.figures.style import save_figure
    from ghest_rt.studies.movements import Movements as MovementsOf

    plan = AccuracyPlan(
        movements=MovementsOf(
            tuple(m.value for m in movement or ()), tuple(motion or ()), duration or (_QUICK_DURATION_S if quick else None)
        ),
        sensors=tuple(s.value for s in sensor) if sensor else ("paper",) if quick else ("paper", "sr300"),
        methods=chosen_methods(method),
        seeds=tuple(range(1, (2 if quick else seeds) + 1)),
    )
    with shown_progress("study accuracy") as progress:
        rows, cpu_s = run_accuracy(plan, store_in(out), executor(workers, scheduler), progress)
    entries = table(rows)
    folder = out / "accuracy"
    write_tables(rows, folder, "rows")
    write_tables(entries, folder, "table")
    for name in plan.sensors:
        save_figure(draw_figure_13(rows, name), folder / "figures", f"figure13_{name}")
    found = [asdict(check) for check in checks(entries)]
    document: dict[str, object] = {
        "study": "accuracy",
        "seeds": list(plan.seeds),
        "duration_s": plan.movements.duration_s,
        "cpu_s": cpu_s,
        "table": entries,
        "checks": found,
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
        title="RMS errors, mean over seeds, ± half its 95 % confidence interval (Tables 5, 6)",
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
    )
    for column in ("sensor: method", "movement"):
        shown.add_column(column, no_wrap=True)
    for title in _TITLES.values():
        shown.add_column(title, justify="right", no_wrap=True)
    by_place: dict[tuple[str, str, str], dict[str, dict[str, Any]]] = {}
    for e in document["table"]:
        by_place.setdefault((e["sensor"], e["method"], e["movement"]), {})[e["quantity"]] = e
    reported: dict[str, dict[str, dict[str, Any]]] = {}
    for (sensor, method, movement), of in by_place.items():
        shown.add_row(f"{sensor}: {method}", movement, *(_cell(of[q], q) for q in _TITLES))
        if any(e["paper_rms"] is not None for e in of.values()):
            reported[movement] = of
    if reported:
        shown.add_section()
    for movement, of in reported.items():
        shown.add_row("as published", movement, *(_number(of[q]["paper_rms"], q) for q in _TITLES))
    console = Console()
    console.print(shown)
    show_end(console, document, folder)


def _cell(entry: dict[str, Any], quantity: str) -> str:
    if entry["rms_low"] is None:
        return _number(entry["rms"], quantity)
    half = (entry["rms_high"] - entry["rms_low"]) / 2
    return f"{_number(entry['rms'], quantity)}\n±{_number(half, quantity, digits=2)}"


def _number(value: float | None, quantity: str, digits: int = 3) -> str:
    if value is None:
        return "-"
    return f"{value if quantity.endswith('_deg') else 1e3 * value:.{digits}g}"
