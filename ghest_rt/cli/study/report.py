"""`ghest-rt study report`: all studies of a results folder on one page."""

from pathlib import Path
from typing import Annotated

import typer

from ghest_rt.cli.options import Json
from ghest_rt.extras import need_extra


def report(
    results: Annotated[Path, typer.Argument(metavar="FOLDER", help="Results folder of the studies")] = Path("out/study"),
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="HTML file to write; by default report.html in the folder", show_default=False),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write one self-contained HTML page with every table and figure, the paper's values beside; it needs no network."""
    from ghest_rt.cli.console import print_json

    need_extra("study", "a study")
    from ghest_rt.studies.report.write import write_report

    path = out or results / "report.html"
    studies = write_report(results, path)
    if as_json:
        print_json({"report": str(path), "studies": studies, "size_bytes": path.stat().st_size})
    else:
        typer.echo(f"{path}: {', '.join(studies)} ({path.stat().st_size / 1e6:.1f} MB)")
