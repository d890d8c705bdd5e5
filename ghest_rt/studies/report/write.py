"""`study report`: everything in a results folder on one page that needs nothing else."""

from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.extras import need_extra
from ghest_rt.studies.report.accuracy_section import accuracy_section
from ghest_rt.studies.report.compare_section import compare_section
from ghest_rt.studies.report.key_figures import key_figures
from ghest_rt.studies.report.latency_section import latency_section
from ghest_rt.studies.report.page import Section
from ghest_rt.studies.report.sensitivity_section import sensitivity_section
from ghest_rt.studies.results import read_summary

Builder = Callable[[dict[str, Any], Path], Section]

_TITLE = "Glenohumeral angles inside an exoskeleton: the evaluation"
_LEAD = (
    "The paper's tables and figures made again from nothing with this system's methods beside: `paper`, the published method; "
    "`refined`, the same chain with sub-pixel vision and synchronised inputs; `fused`, the filter that answers without lag."
)
_PAPER = "C. Cortés et al., Optical Enhancement of Exoskeleton-Based Estimation of Glenohumeral Angles, 2016"
_STUDIES: dict[str, tuple[str, Builder]] = {
    "accuracy": ("Accuracy", accuracy_section),
    "sensitivity": ("Sensitivity", sensitivity_section),
    "compare": ("Comparison with other ways (Table 7)", compare_section),
    "latency": ("Latency and prediction", latency_section),
}


def write_report(folder: Path, out: Path) -> list[str]:
    """Write the report; return the studies that were found.

    Args:
        folder: The results folder of the studies.
        out: The HTML file.

    Raises:
        BadInputError: The folder holds no study, or a damaged one, or `out` has another ending than a page's.
        GhestError: Jinja2 is not installed, or the file cannot be written.
    """
    if out.suffix.lower() not in {".html", ".htm"}:
        raise BadInputError(f"--out {out}: the report is an HTML page; name a file that ends in .html")
    need_extra("study", "the report")
    from jinja2 import Environment, FileSystemLoader, StrictUndefined  # noqa: PLC0415 - an extra, imported only when used

    summaries = {name: found for name in _STUDIES if (found := read_summary(folder, name)) is not None}
    if not summaries:
        raise BadInputError(f"{folder}: holds no study; run `ghest-rt study accuracy --out {folder}` or another one first")
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    page = environment.get_template("report.html.j2").render(
        title=_TITLE,
        lead=_LEAD.replace("`", ""),
        sections=[_section(name, summaries, folder) for name in _STUDIES],
        key_figures=key_figures(summaries),
        version=version("ghest-rt"),
        paper=_PAPER,
    )
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(page, encoding="utf-8")
    except OSError as error:
        raise GhestError(f"{out}: cannot be written: {error.strerror or error}") from error
    return list(summaries)


def _section(name: str, summaries: dict[str, dict[str, Any]], folder: Path) -> Section:
    title, build = _STUDIES[name]
    if name not in summaries:
        return Section(key=name, title=title, missing=True)
    try:
        return build(summaries[name], folder / name)
    except (KeyError, IndexError, StopIteration, TypeError) as error:
        raise BadInputError(
            f"{folder / name}: the summary is not what this version writes ({type(error).__name__}: {error}); "
            f"run `ghest-rt study {name}` again"
        ) from error
