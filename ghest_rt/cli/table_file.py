"""Estimates as a table in a file: CSV, or Parquet with the extra `parquet`. The same estimates give the same bytes."""

import csv
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from ghest_rt.errors import BadInputError
from ghest_rt.estimation.angles import GH_SIGNS, AngleSigns, Arm
from ghest_rt.extras import need_extra
from ghest_rt.geometry.so3 import quat_wxyz_from_matrix
from ghest_rt.messages.results import GhEstimate
from ghest_rt.service.compose import clinical_deg, sigma_of

Row = tuple[int | float | str | None, ...]

_NUMBERS = (
    "flexion_deg",
    "abduction_deg",
    "rotation_deg",
    "qw",
    "qx",
    "qy",
    "qz",
    "arm_x_m",
    "arm_y_m",
    "arm_z_m",
    "sigma_flexion_deg",
    "sigma_abduction_deg",
    "sigma_rotation_deg",
    "m0_x_m",
    "m0_y_m",
    "m0_z_m",
    "m1_x_m",
    "m1_y_m",
    "m1_z_m",
)
COLUMNS = ("seq", "t_capture_ns", "status", "reason", *_NUMBERS)

Writer = Callable[[Path, Sequence[Row]], None]


def row_of(seq: int, estimate: GhEstimate, arm: Arm, signs: AngleSigns = GH_SIGNS) -> Row:
    """Return an estimate as a row of `COLUMNS`; without angles the numbers are None.

    The quaternion is the arm in the GH frame, `arm_*` its position in the m0 frame, `m0_*` and `m1_*` the markers in the base
    frame E.
    """
    head = (seq, estimate.t_sample_ns, str(estimate.status), str(estimate.reason))
    R, m0_from_arm = estimate.gh_from_arm, estimate.m0_from_arm
    if R is None or m0_from_arm is None:
        return (*head, *([None] * len(_NUMBERS)))
    angles, sigma = clinical_deg(R, arm, signs), sigma_of(R, estimate.covariance)
    markers: list[float | None] = []
    for pose in (estimate.e_from_m0, estimate.e_from_m1):
        markers.extend([None] * 3 if pose is None else pose[:3, 3].tolist())
    return (
        *head,
        angles.flexion,
        angles.abduction,
        angles.rotation,
        *quat_wxyz_from_matrix(R).tolist(),
        *m0_from_arm[:3, 3].tolist(),
        *((None, None, None) if sigma is None else (sigma.flexion, sigma.abduction, sigma.rotation)),
        *markers,
    )


def writer_for(path: Path) -> Writer:
    """Return what writes a table to this file, judged by its ending.

    Raises:
        BadInputError: Another ending, or no such folder.
        GhestError: The extra `parquet` is not installed.
    """
    if not path.parent.is_dir():
        raise BadInputError(f"{path.parent}: no such folder; make it first, or write elsewhere")
    if path.suffix == ".csv":
        return _write_csv
    if path.suffix == ".parquet":
        need_extra("parquet", f"{path} (unlike a .csv)")
        return _write_parquet
    raise BadInputError(f"{path}: name a file that ends in .csv or .parquet")


def write_table(path: Path, write: Writer, rows: Sequence[Row]) -> None:
    """Write the file whole or not at all.

    Raises:
        BadInputError: The file cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        write(part, rows)
        part.replace(path)
    except OSError as error:
        raise BadInputError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        part.unlink(missing_ok=True)


def _write_csv(path: Path, rows: Iterable[Row]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows([_text(value) for value in row] for row in rows)


def _text(value: float | str | None) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def _write_parquet(path: Path, rows: Sequence[Row]) -> None:
    import pyarrow  # noqa: PLC0415  (optional: the extra `parquet`)
    import pyarrow.parquet  # noqa: PLC0415

    types = (pyarrow.int64(), pyarrow.int64(), pyarrow.string(), pyarrow.string(), *([pyarrow.float64()] * len(_NUMBERS)))
    arrays = [pyarrow.array([row[index] for row in rows], type=kind) for index, kind in enumerate(types)]
    table = pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(list(zip(COLUMNS, types, strict=True))))
    pyarrow.parquet.write_table(table, path)
