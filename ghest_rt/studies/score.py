"""Run a recording through a method and compare with its truth."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean

from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.estimation.pipeline import Pipeline
from ghest_rt.messages.results import GhEstimate, Reason, Status, TruthSample
from ghest_rt.recording.reader import Recording
from ghest_rt.studies.metrics import ErrorAccumulator
from ghest_rt.studies.truth import TruthTrack
from ghest_rt.vision.station import Method

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class RecordingScore:
    """The paper's metrics (3.4.2) of one recording and method.

    Attributes:
        recording: The file.
        method: The method judged.
        orientation_rmse_deg: RMS of the norm of the exponential map of the arm's orientation error in the m0 frame.
        position_rmse_m: RMS distance between true and estimated arm position in the m0 frame.
        m0_rmse_m: RMS distance between true and estimated position of marker m0 in the exoskeleton base frame.
        m1_rmse_m: The same of marker m1.
        samples: Instants of the grid.
        starting: Of these before every input had arrived; the shares are of the others, as those of a live run are.
        angles_fraction: Share with angles, those of status `degraded` too.
        valid_fraction: Share with status `valid`.
        lost: Samples without angles, by reason; those before the start are not among them.
        skipped: What of the recording could not be used.
        unused: Samples that the estimator did not use, by reason.
        published_orientation_rmse_deg: As `orientation_rmse_deg`, against the truth at the instant when a sample is published
            (`lag_ns` after its own): what a subscriber who takes it for now is wrong by.
        elbow_flexion_rmse_deg: RMS error of the elbow's flexion; None where there is none, or no truth of it.
    """

    recording: str
    method: str
    orientation_rmse_deg: float
    position_rmse_m: float
    m0_rmse_m: float
    m1_rmse_m: float
    samples: int
    starting: int
    angles_fraction: float
    valid_fraction: float
    lost: dict[str, int]
    skipped: tuple[str, ...]
    unused: dict[str, int]
    published_orientation_rmse_deg: float
    elbow_flexion_rmse_deg: float | None


@dataclass(frozen=True, slots=True)
class JudgedRun:
    """A recording's estimates beside its truth; they are published `lag_ns` after the instants they hold for."""

    recording: Recording
    method: str
    estimates: list[GhEstimate]
    truth: TruthTrack
    unused: dict[str, int]
    lag_ns: int


def run_with_truth(
    path: Path, method: Method | None = None, station: LoadedStation | None = None, progress: Progress | None = None
) -> JudgedRun:
    """Estimate every grid instant of a recording that carries truth.

    Args:
        path: The recording.
        method: None for the station's.
        station: Takes the place of the station in the recording.
        progress: Told the share done, 0 to 1.

    Raises:
        BadInputError: The recording cannot be used, or has no truth.
    """
    recording = Recording(path)
    if not recording.has_truth:
        raise BadInputError(
            f"{path}: no topic /truth/state, so there is nothing to compare with; `ghest-rt estimate` needs none"
        )
    truth = TruthTrack()
    pipeline = Pipeline(station or recording.station, recording.camera_infos, recording.encoder_joints, method)

    def events() -> Iterator[object]:
        yield from _keep_truth(recording.events(), truth)

    estimates: list[GhEstimate] = []
    for estimate in estimate_events(events(), pipeline, t_0_ns=recording.grid_t_0_ns):
        estimates.append(estimate)
        if progress is not None and len(estimates) % 20 == 0:
            progress(min(1.0, (estimate.t_sample_ns - estimates[0].t_sample_ns) / max(recording.duration_ns, 1)))
    return JudgedRun(recording, pipeline.method, estimates, truth, pipeline.counts(), pipeline.lag_ns)


def score_recording(
    path: Path, method: Method | None = None, station: LoadedStation | None = None, progress: Progress | None = None
) -> RecordingScore:
    """Score one recording; arguments and errors as of `run_with_truth`, and `BadInputError` where nothing can be judged."""
    run = run_with_truth(path, method, station, progress)
    errors, published = ErrorAccumulator(), ErrorAccumulator()
    elbow_rad: list[float] = []
    for estimate in run.estimates:
        truth = run.truth.at(estimate.t_sample_ns)
        errors.add(estimate, truth)
        published.add(estimate, run.truth.at(estimate.t_sample_ns + run.lag_ns))
        if estimate.elbow is not None and truth is not None and truth.elbow_rad is not None:
            elbow_rad.append(estimate.elbow.flexion_rad - truth.elbow_rad[0])
    after_start = [estimate for estimate in run.estimates if estimate.reason is not Reason.STARTING]
    statuses = Counter(estimate.status for estimate in after_start)
    lost = Counter(str(estimate.reason) for estimate in after_start if estimate.status is Status.LOST)
    if not errors.judged:
        raise BadInputError(
            f"{path}: method {run.method} finds nothing to compare with the truth, {errors.samples} samples, {_times(lost)}; "
            "is it the method for these markers (--method)?"
        )
    rms = errors.rms()
    return RecordingScore(
        recording=str(path),
        method=run.method,
        orientation_rmse_deg=math.degrees(rms.orientation_rad),
        position_rmse_m=rms.position_m,
        m0_rmse_m=rms.m0_m,
        m1_rmse_m=rms.m1_m,
        samples=errors.samples,
        starting=errors.samples - len(after_start),
        angles_fraction=(len(after_start) - statuses[Status.LOST]) / len(after_start),
        valid_fraction=statuses[Status.VALID] / len(after_start),
        lost=dict(lost),
        skipped=tuple(str(problem) for problem in run.recording.problems),
        unused=run.unused,
        published_orientation_rmse_deg=math.degrees(published.rms().orientation_rad),
        elbow_flexion_rmse_deg=math.degrees(math.sqrt(fmean(e * e for e in elbow_rad))) if elbow_rad else None,
    )


def _times(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{reason} x{counts[reason]}" for reason in sorted(counts)) or "all before the start"


def _keep_truth(events: Iterable[object], truth: TruthTrack) -> Iterator[object]:
    for event in events:
        if isinstance(event, TruthSample):
            truth.add(event)
        else:
            yield event
