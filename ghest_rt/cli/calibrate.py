"""`ghest-rt calibrate`: a recorded calibration session makes a new station file."""

import logging
import math
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from rich.text import Text

from ghest_rt.calibration.arm_axis import ArmAxis
from ghest_rt.calibration.calibrate import Outcome, calibrate, check_joint, id_from, new_station_text
from ghest_rt.calibration.options import CalibrationOptions
from ghest_rt.calibration.report import notes_of, rows_of
from ghest_rt.calibration.session import Session, read_session
from ghest_rt.calibration.solve import Found
from ghest_rt.cli.console import print_json, printing
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.station import StationConfig
from ghest_rt.errors import BadInputError
from ghest_rt.extras import need_extra
from ghest_rt.recording.reader import Recording

_log = logging.getLogger(__name__)

_PICTURES = (".png", ".svg", ".pdf")
_AXES = ("flexion", "abduction", "rotation")


def calibrate_recording(
    path: Path,
    station_file: Path,
    out: Path,
    *,
    calibration_id: str | None = None,
    elbow_from: ArmAxis = ArmAxis.POSTURE,
    arm_length_m: float | None = None,
    posture_unchecked: bool = False,
    picture: Path | None = None,
    force: bool = False,
    as_json: bool = False,
) -> None:
    """Calibrate, write the new station file if the session is good enough, and print what has changed.

    Raises:
        BadInputError: A file or option cannot be used, or the session is not good enough: says why and what to do.
        GhestError: The extra `plots` is missing for a picture; standard output is full, the new station file written.
    """
    station = load_station(station_file)
    check_joint(station)
    _check_out(out, station_file, station, force=force)
    if picture is not None:
        if picture.suffix.lower() not in _PICTURES or not picture.parent.is_dir():
            raise BadInputError(f"{picture}: name a file that ends in {', '.join(_PICTURES)}, in a folder that is there")
        need_extra("plots", "a picture")
    options = CalibrationOptions(
        calibration_id=id_from(path, station.config.calibration.id) if calibration_id is None else calibration_id,
        elbow_from=elbow_from,
        arm_length_m=arm_length_m,
        posture_unchecked=posture_unchecked,
    )
    recording = Recording(path)
    session = _read(recording, station)
    for problem in recording.problems:
        _log.warning("%s: %s", path, problem)
    outcome = calibrate(session, station, options)
    if outcome.found is not None and outcome.calibration is not None:
        _write(out, new_station_text(station, outcome.calibration, outcome.found.hold, path.name))
    if picture is not None and outcome.found is not None:
        from ghest_rt.calibration.picture import draw_calibration  # noqa: PLC0415 - an extra, imported only when used

        draw_calibration(session, outcome.found, picture)
    if as_json:
        print_json(_document(path, out, station, session, outcome))
    else:
        with printing():
            _print(path, out, station, session, outcome)
    if outcome.calibration is None:
        reasons = "\n".join(f"  {objection.text}" for objection in outcome.objections)
        raise BadInputError(f"{path}: not good enough to calibrate by; {out} is not written:\n{reasons}")


def _read(recording: Recording, station: LoadedStation) -> Session:
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as progress:
        task = progress.add_task(f"finding markers in {recording.path.name}", total=1.0)
        return read_session(recording, station, lambda share: progress.update(task, completed=share))


def _check_out(out: Path, station_file: Path, station: LoadedStation, *, force: bool) -> None:
    """Refuse an output file before the long part of the work.

    Raises:
        BadInputError: It is there, or its folder lacks a file that it would name.
    """
    if out.exists() and not force:
        raise BadInputError(f"{out}: is there already; name another file, or overwrite it with --force")
    if out.is_dir() or not out.parent.is_dir():
        raise BadInputError(f"{out}: name a file, in a folder that is there")
    for key, name in _named(station.config):
        if (station_file.parent / name).exists() and not (out.parent / name).exists():
            raise BadInputError(
                f"{out}: {key} = {name!r} is looked for beside the station file, and is not there: "
                f"write the new file beside {station_file}, or give an absolute path in it"
            )


def _named(config: StationConfig) -> Iterator[tuple[str, str]]:
    """Yield what a station file names by paths relative to itself, by key."""
    yield "exoskeleton.urdf", config.exoskeleton.urdf
    devices = {f"cameras.{name}.device": camera.device for name, camera in config.cameras.items()}
    for key, device in {**devices, "encoders.device": config.encoders.device}.items():
        for field in ("dbc", "path"):
            if hasattr(device, field):
                yield f"{key}.{field}", str(getattr(device, field))
    if config.publisher.identity is not None:
        yield "publisher.identity", config.publisher.identity


def _write(out: Path, text: str) -> None:
    part = out.with_name(out.name + ".part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(out)
    except OSError as error:
        raise BadInputError(f"{out}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)


def _print(path: Path, out: Path, station: LoadedStation, session: Session, outcome: Outcome) -> None:
    console = Console()
    found = outcome.found
    if found is None:
        return
    table = Table(title=Text(f"Calibration from {path.name}"), title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("quantity", no_wrap=True)
    for column in ("before", "after", "change", "std. dev."):
        table.add_column(column, justify="right", overflow="fold")
    for row in rows_of(station.config.calibration, found):
        table.add_row(row.quantity, row.before, row.after, row.change, row.sigma)
    console.print(table)
    console.print(
        "std. dev.: what is random within this session; 'held': by how much the neutral posture strayed", highlight=False
    )
    for line in (*_quality(session, found), *notes_of(found)):
        console.print(f"- {line}", highlight=False, markup=False)
    verdict = "not good enough" if outcome.objections else "good"
    console.print(f"verdict: {verdict}", style="red" if outcome.objections else "green", highlight=False)
    if outcome.calibration is not None:
        console.print(f"{out}: calibration {outcome.calibration.id}", highlight=False, markup=False)


def _quality(session: Session, found: Found) -> list[str]:
    ranges = ", ".join(f"{name} {math.degrees(rad):.0f}°" for name, rad in zip(_AXES, found.range_rad.tolist(), strict=True))
    gh, hold = found.gh, found.hold
    return [
        f"residual {1000 * gh.residual_rms_m:.2f} mm RMS over {len(session.t_s)} samples "
        f"({100 * session.seen_fraction:.0f} % of the session), {100 * (1 - float(gh.used.mean())):.1f} % outliers",
        f"range of motion: {ranges}; GH centre known to {1000 * max(gh.first_sigma_m, gh.second_sigma_m):.2f} mm",
        f"neutral posture held from {hold.start_s:.1f} to {hold.end_s:.1f} s, "
        f"still to {math.degrees(max(hold.m0_rad, hold.m1_rad)):.2f}° RMS",
    ]


def _document(path: Path, out: Path, station: LoadedStation, session: Session, outcome: Outcome) -> dict[str, object]:
    document: dict[str, object] = {
        "recording": str(path),
        "out": None if outcome.objections else str(out),
        "objections": [{"reason": str(o.refusal), "text": o.text} for o in outcome.objections],
        "seen_fraction": session.seen_fraction,
    }
    found, new = outcome.found, outcome.calibration
    if found is not None:
        document |= {
            "calibration": None if new is None else new.model_dump(),
            "rows": [asdict(row) for row in rows_of(station.config.calibration, found)],
            "notes": notes_of(found),
            "residual_rms_m": found.gh.residual_rms_m,
            "outlier_fraction": 1.0 - float(found.gh.used.mean()),
            "centre_sigma_m": {"m0": found.gh.first_sigma_m, "m1": found.gh.second_sigma_m},
            "range_deg": dict(zip(_AXES, (math.degrees(rad) for rad in found.range_rad.tolist()), strict=True)),
            "hold_s": [found.hold.start_s, found.hold.end_s],
            "arm_length_source": found.length.source,
        }
    return document
