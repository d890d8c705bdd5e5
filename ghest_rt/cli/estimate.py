"""`ghest-rt estimate`: a recording to a table, as fast as the machine allows."""

import logging
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from ghest_rt.cli.console import print_json, printing
from ghest_rt.cli.options import Method
from ghest_rt.cli.table_file import Row, row_of, write_table, writer_for
from ghest_rt.cli.unused_words import unused_in_words
from ghest_rt.config.load import load_station
from ghest_rt.estimation.angles import signs_of
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.messages.results import Status
from ghest_rt.recording.reader import Recording

_log = logging.getLogger(__name__)


def estimate(path: Path, method: Method | None, out: Path, station_file: Path | None, as_json: bool) -> None:
    """Estimate every grid instant of a recording and write the table.

    Raises:
        BadInputError: The recording, the station file or the output file cannot be used.
    """
    write = writer_for(out)
    recording = Recording(path)
    station = recording.station if station_file is None else load_station(station_file)
    pipeline = Pipeline(station, recording.camera_infos, recording.encoder_joints, None if method is None else method.value)
    signs = signs_of(station.config.joint)
    rows: list[Row] = []
    statuses: Counter[Status] = Counter()
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        task = progress.add_task(f"estimating {path.name}", total=max(recording.duration_ns, 1))
        first_ns: int | None = None
        for seq, sample in enumerate(estimate_events(recording.events(), pipeline, t_0_ns=recording.grid_t_0_ns)):
            first_ns = sample.t_sample_ns if first_ns is None else first_ns
            rows.append(row_of(seq, sample, station.config.station.arm, signs))
            statuses[sample.status] += 1
            if seq % 50 == 0:
                progress.update(task, completed=sample.t_sample_ns - first_ns)
    write_table(out, write, rows)
    for problem in recording.problems:
        _log.warning("%s: %s", path, problem)
    fractions = {status: statuses[status] / len(rows) if rows else 0.0 for status in (Status.VALID, Status.DEGRADED)}
    unused = pipeline.counts()
    if as_json:
        print_json(
            {
                "recording": str(path),
                "out": str(out),
                "method": pipeline.method,
                "samples": len(rows),
                "valid_fraction": fractions[Status.VALID],
                "degraded_fraction": fractions[Status.DEGRADED],
                "skipped": [str(problem) for problem in recording.problems],
                "unused": unused,
            }
        )
    else:
        shares = ", ".join(f"{100 * share:.2f} % {status}" for status, share in fractions.items())
        with printing():
            Console().print(f"{out}: {len(rows)} samples, {shares}, method {pipeline.method}")
            if unused:
                Console().print(unused_in_words(unused))
