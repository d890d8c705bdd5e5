"""`ghest-rt study compare`: Table 7 made real."""

from pathlib import Path
from typing import Annotated, Any, cast

import typer

from ghest_rt.cli.options import Json, Sensor
from ghest_rt.cli.study.options import Duration, Motions, Movements, Out, Quick, Scheduler, Workers
from ghest_rt.extras import need_extra


def compare(
    out: Out = Path("out/study"),
    sensor: Annotated[
        list[Sensor] | None, typer.Option(help="Sensor; again for more. By default the paper's", show_default=False)
    ] = None,
    movement: Movements = None,
    motion: Motions = None,
    seeds: Annotated[int, typer.Option(min=1, metavar="N", help="Repeat with so many seeds")] = 1,
    duration: Duration = None,
    quick: Quick = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """The rivals beside this system on the same sessions, and whether `fused` wins: Table 7."""
    from ghest_rt.cli.study.running import executor, shown_progress, store_in

    need_extra("study", "a study")
    from ghest_rt.cli.console import print_json
    from ghest_rt.studies import movements as plan
    from ghest_rt.studies.compare import QUICK, CompareSettings
    from ghest_rt.studies.compare import compare as run_compare
    from ghest_rt.studies.figures.style import save_figure
    from ghest_rt.studies.report.compare_figures import draw_angles, draw_contenders
    from ghest_rt.studies.report.results import write_results

    names = tuple(m.value for m in movement or ())
    movements = plan.Movements(names, tuple(motion or ()), duration)
    settings = CompareSettings(
        movements=movements.or_else(QUICK) if quick else movements,
        sensors=tuple(s.value for s in sensor or (Sensor.PAPER,)),
        seeds=seeds,
    )
    with shown_progress("compare") as progress:
        summary = run_compare(settings, store_in(out), executor(workers, scheduler), progress)
    document = write_results(out, "compare", summary, cast(list[dict[str, object]], summary["rows"]))
    for name in document["settings"]["sensors"]:
        save_figure(draw_contenders(document, name), out / "compare" / "figures", f"contenders_{name}")
        save_figure(draw_angles(document, name), out / "compare" / "figures", f"angles_{name}")
    if as_json:
        print_json(document)
    else:
        _print(document, out / "compare")


def _print(summary: dict[str, Any], folder: Path) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console()
    contenders, verdicts = summary["contenders"], summary["verdicts"]
    for k, group in enumerate(contenders[0]["measured"]):
        of_kind = "Table 2's movements" if group["kind"] == "therapy" else "recorded movements"
        table = Table(
            title=f"RMS errors in degrees, mean over {of_kind}, sensor {group['sensor']}",
            title_justify="left",
            box=box.SIMPLE_HEAD,
            pad_edge=False,
        )
        table.add_column("contender", no_wrap=True)
        for column in ("arm\n°", "publ.\n°", "flex.\n°", "abd.\n°", "rot.\n°", "fused\nwins"):
            table.add_column(column, justify="right", no_wrap=True)
        for who in contenders:
            row = who["measured"][k]
            mine = [v for v in verdicts if v["contender"] == who["key"] and v["sensor"] == group["sensor"]]
            mine = [v for v in mine if v["movement"] in _movements(summary, group)]
            won = f"{sum(v['fused_wins'] for v in mine)}/{len(mine)}" if mine else ""
            figures = ("orientation_deg", "published_deg", "flexion_deg", "abduction_deg", "rotation_deg")
            table.add_row(who["title"], *(_deg(row[name]) for name in figures), won)
        console.print(table)
    console.print(
        "publ.: judged at the instant of publishing; fused wins: movements in which it is nearer in all other columns"
    )
    rest = summary["inertial_after_rest"]
    console.print(
        f"inertial sensors drift: off by {_deg(rest['error_deg'])}° after holding still for {rest['rest_s']:.0f} s",
        highlight=False,
    )
    console.print("\nWhat their own publications report:", highlight=False)
    for who in contenders:
        if who["published"] != "none":
            console.print(f"  {who['title']}: {who['published']}", markup=False, highlight=False)
    console.print("\nWhere fused does not win:" if not all(v["fused_wins"] for v in verdicts) else "\nfused wins everywhere.")
    for line in verdicts:
        if not line["fused_wins"]:
            console.print(f"  {line['movement']} ({line['sensor']}): {line['verdict']}", markup=False, highlight=False)
    console.print(f"Tables, summary and figures: {folder}", markup=False)


def _deg(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.3f}" if value < 1.0 else f"{value:.3g}"


def _movements(summary: dict[str, Any], group: dict[str, Any]) -> set[str]:
    return {row["movement"] for row in summary["rows"] if (row["sensor"], row["kind"]) == (group["sensor"], group["kind"])}
