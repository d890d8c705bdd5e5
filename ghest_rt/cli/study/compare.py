"""`ghest-rt study compare`: Table 7 made real."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ghest_rt.cli.options import Json
from ghest_rt.cli.study.options import (
    Duration,
    Motions,
    Movements,
    Out,
    Scheduler,
    Seeds,
    Sensors,
    Workers,
    chosen_sensors,
    movements_of,
)
from ghest_rt.extras import need_extra

if TYPE_CHECKING:
    from rich.console import Console

_COLUMNS = {
    "orientation_deg": "arm\n°",
    "published_deg": "publ.\n°",
    "flexion_deg": "flex.\n°",
    "abduction_deg": "abd.\n°",
    "rotation_deg": "rot.\n°",
}


def compare(
    out: Out = Path("out/study"),
    sensor: Sensors = None,
    movement: Movements = None,
    motion: Motions = None,
    seeds: Seeds = None,
    duration: Duration = None,
    quick: Annotated[
        bool,
        typer.Option("--quick", metavar="", help="A small version, to see that it works: 1.5 s of COMB; what is named counts"),
    ] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: Json = False,
) -> None:
    """The rivals beside this system on the same sessions, and whether `fused` wins: Table 7."""
    from ghest_rt.cli.study.running import finish, opened, shown_progress

    need_extra("study", "a study")
    from ghest_rt.studies.compare.study import QUICK, CompareSettings
    from ghest_rt.studies.compare.study import compare as run_compare
    from ghest_rt.studies.figures.compare import figures
    from ghest_rt.studies.results import write_study

    settings = CompareSettings(
        movements=movements_of(movement, motion, duration, QUICK if quick else None),
        sensors=chosen_sensors(sensor),
        seeds=seeds or 1,
    )
    store, runs_on = opened(out, workers, scheduler)
    with shown_progress("study compare") as progress:
        summary = run_compare(settings, store, runs_on, progress)
    document = write_study(out, summary, {"rows": summary["rows"]}, figures(summary))
    finish(document, out, as_json, _show)


def _show(document: dict[str, Any], console: "Console") -> None:
    from ghest_rt.cli.study.running import new_table
    from ghest_rt.studies.compare.verdicts import tally
    from ghest_rt.studies.numbers import number, percent

    contenders, verdicts = document["contenders"], document["verdicts"]
    for k, group in enumerate(contenders[0]["measured"]):
        of_kind = "Table 2's movements" if group["kind"] == "therapy" else "recorded movements"
        table = new_table(
            f"RMS errors in degrees, mean over {of_kind}, sensor {group['sensor']}",
            ("contender",),
            (*_COLUMNS.values(), "fused\nwins"),
        )
        for who in contenders:
            row = who["measured"][k]
            won = tally(verdicts, who["key"], group["sensor"], group["kind"])
            figures = (number(row[name]) for name in _COLUMNS)
            table.add_row(who["title"], *figures, f"{won.own_instant}/{won.rows}" if won.rows else "")
        console.print(table)
        shares = [(who["title"], who["measured"][k]["answered_fraction"]) for who in contenders]
        seldom = [f"{title} {percent(share)} %" for title, share in shares if share < 1.0]
        if seldom:
            console.print(f"Not answered at every instant: {', '.join(seldom)}", markup=False, highlight=False)
    console.print(
        "publ.: judged at the instant of publishing; fused wins: movements in which it is nearer in orientation and all three "
        "angles where both answer, and answers as often"
    )
    rest = document["inertial_after_rest"]
    console.print(
        f"inertial sensors drift: off by {number(rest['error_deg'])}° after holding still for {rest['rest_s']:.0f} s",
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
