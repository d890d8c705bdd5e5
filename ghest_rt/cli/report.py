"""What a run came to, at its end."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

from rich import box
from rich.console import Console
from rich.table import Table

from ghest_rt.cli.console import print_json
from ghest_rt.cli.scoreboard import Scoreboard
from ghest_rt.cli.unused_words import unused_in_words
from ghest_rt.messages.published import Lateness
from ghest_rt.service.contract import ServiceSummary
from ghest_rt.service.health import SampleCounts
from ghest_rt.service.recorder_settings import RecorderCounts


@dataclass(frozen=True, slots=True)
class RunReport:
    """One run of the service.

    Attributes:
        source: The recording, or the station.
        method: Estimation method.
        duration_s: Of the samples after the start.
        samples: Published.
        starting: Of these while not every input had arrived.
        valid_fraction: Share of valid ones, after the start.
        degraded_fraction: Share of degraded ones (angles from less than normal), after the start.
        rate_hz: Samples per second of their own time, after the start.
        missed_ticks: Grid slots skipped; None without a clock.
        lateness: Of the ticks; None without a clock.
        skipped_frames: Frames passed over because they were too old when their turn came; None without a clock.
        judged: Samples compared with the truth.
        orientation_rmse_deg: Against the truth; None without.
        position_rmse_mm: Against the truth; None without.
        problems: What was left out of the recording.
        unused: Samples that the estimator did not use, by reason.
    """

    source: str
    method: str
    duration_s: float
    samples: int
    starting: int
    valid_fraction: float
    degraded_fraction: float
    rate_hz: float
    missed_ticks: int | None
    lateness: Lateness | None
    skipped_frames: int | None
    judged: int
    orientation_rmse_deg: float | None
    position_rmse_mm: float | None
    problems: tuple[str, ...]
    unused: Mapping[str, int]


def report_of(
    source: str,
    method: str,
    result: ServiceSummary | SampleCounts,
    scoreboard: Scoreboard | None,
    *,
    problems: Sequence[object] = (),
    unused: Mapping[str, int] | None = None,
) -> RunReport:
    """Return the report of a paced run (a summary, which counts the unused samples) or an unpaced one (counts)."""
    paced = result if isinstance(result, ServiceSummary) else None
    judged = scoreboard.judged if scoreboard is not None else 0
    after_start = result.published - result.starting
    return RunReport(
        source=source,
        method=method,
        duration_s=result.duration_s,
        samples=result.published,
        starting=result.starting,
        valid_fraction=result.valid / after_start if after_start else 0.0,
        degraded_fraction=result.degraded / after_start if after_start else 0.0,
        rate_hz=(after_start - 1) / result.duration_s if result.duration_s > 0 else 0.0,
        missed_ticks=paced.missed_ticks if paced else None,
        lateness=paced.lateness if paced else None,
        skipped_frames=sum(counters.skipped for counters in paced.inputs.values()) if paced else None,
        judged=judged,
        orientation_rmse_deg=scoreboard.orientation_rmse_deg if scoreboard is not None and judged else None,
        position_rmse_mm=scoreboard.position_rmse_mm if scoreboard is not None and judged else None,
        problems=tuple(str(problem) for problem in problems),
        unused=dict(paced.unused if paced else unused or {}),
    )


def print_reports(
    console: Console, reports: Sequence[RunReport], as_json: bool, recorded: RecorderCounts | None = None
) -> None:
    """Print the reports, and what was recorded, as a table or as one JSON document on standard output."""
    from ghest_rt.cli.recording import print_recorded, recorded_document  # noqa: PLC0415  (a start need not wait for it)

    if as_json:
        runs = {"runs": [_document(report) for report in reports]}
        print_json(runs if recorded is None else {**runs, "recording": recorded_document(recorded)})
        return
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("source", overflow="fold", min_width=10)
    for column in (
        "method",
        "samples",
        "valid\n%",
        "rate\nHz",
        "missed",
        "late ms\np50/p99",
        "rms error\n°/mm",
    ):
        table.add_column(column, justify="right", no_wrap=True)
    for report in reports:
        late = report.lateness
        table.add_row(
            report.source,
            report.method,
            str(report.samples),
            f"{100.0 * report.valid_fraction:.2f}",
            f"{report.rate_hz:.2f}",
            "–" if report.missed_ticks is None else str(report.missed_ticks),
            "–" if late is None else f"{late.p50_us / 1e3:.2f}/{late.p99_us / 1e3:.2f}",
            "no truth"
            if report.orientation_rmse_deg is None
            else f"{report.orientation_rmse_deg:.3f}/{report.position_rmse_mm:.3f}",
        )
    console.print(table)
    for report in reports:
        if report.skipped_frames:
            frames = "1 frame" if report.skipped_frames == 1 else f"{report.skipped_frames} frames"
            console.print(f"{report.source}: {frames} skipped, too old when their turn came")
        if report.degraded_fraction:
            console.print(f"{report.source}: {100.0 * report.degraded_fraction:.2f} % degraded, with angles")
        if report.unused:
            console.print(f"{report.source}: {unused_in_words(report.unused)}")
    if recorded is not None:
        print_recorded(console, recorded)


def _document(report: RunReport) -> dict[str, object]:
    document = asdict(report)
    document["lateness"] = report.lateness.model_dump() if report.lateness is not None else None
    return document
