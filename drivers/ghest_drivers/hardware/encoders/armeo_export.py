"""Armeocontrol's CSV exports: `HH:MM:SS.mmm; value; …;` after a title line. Real ones run at 15.6 ms and repeat rows."""

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ghest_drivers.clock import Clock
from ghest_drivers.errors import BadDeviceData
from ghest_drivers.hardware.encoders.builder import Counting, SampleBuilder
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.file_link import FileEncoderLink
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection
from ghest_drivers.samples import EncoderSample

_TIME = re.compile(r"([0-9]{2}):([0-9]{2}):([0-9]{2})[.,]([0-9]{3})")
_NUMBER = re.compile(r"[+-]?[0-9]{1,15}(?:\.[0-9]{0,15})?(?:[eE][+-]?[0-9]{1,3})?")
_NS_PER_MS = 1_000_000
_DAY_NS = 86_400_000 * _NS_PER_MS
_REPEAT_NS = 2 * _NS_PER_MS
_MAX_BYTES = 200_000_000


@dataclass(frozen=True, slots=True)
class ArmeoExport:
    """Columns of an export.

    Attributes:
        columns: The titles asked for.
        t_ns: (n,) int64, nanoseconds since the midnight before the first row; increasing.
        values: (n, len(columns)) in the units of the export.
    """

    columns: tuple[str, ...]
    t_ns: NDArray[np.int64]
    values: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ArmeoSettings:
    """Replay of an export as an encoder link. `Channel.source` is the title of a column.

    Attributes:
        path: The export.
        channels: The encoders, in the order of the angles delivered.
        time_column: Title of the column with the time of day.
        delimiter: Between columns.
        paced: Deliver each row when it is due; else at once.
    """

    path: Path
    channels: tuple[Channel, ...]
    time_column: str = "Timestamp"
    delimiter: str = ";"
    paced: bool = True


def read_armeo_export(
    path: Path, columns: tuple[str, ...], stats: LinkStats, *, time_column: str = "Timestamp", delimiter: str = ";"
) -> ArmeoExport:
    """Read the named columns of an export; unusable rows are counted in `stats` and left out.

    Raises:
        OSError: The file cannot be read.
        BadDeviceData: It is no such export, or lacks a column.
    """
    rows = list(_rows(_lines(path), columns, stats, time_column=time_column, delimiter=delimiter))
    times = np.array([t_ns for t_ns, _ in rows], dtype=np.int64)
    return ArmeoExport(columns, times, np.array([values for _, values in rows]).reshape(len(rows), len(columns)))


def armeo_link(settings: ArmeoSettings, clock: Clock) -> FileEncoderLink:
    """Return an encoder link that replays an export."""
    columns = tuple(channel.source for channel in settings.channels)

    def samples(stats: LinkStats) -> Iterator[EncoderSample]:
        builder = SampleBuilder(settings.channels, Counting(), stats)
        lines = _lines(settings.path)
        for t_ns, values in _rows(lines, columns, stats, time_column=settings.time_column, delimiter=settings.delimiter):
            sample = builder.build(RawReading(values), t_ns)
            if sample is not None:
                yield sample

    return FileEncoderLink(str(settings.path), settings.channels, samples, clock, paced=settings.paced)


def _lines(path: Path) -> list[str]:
    if path.stat().st_size > _MAX_BYTES:
        raise BadDeviceData(f"larger than {_MAX_BYTES // 1_000_000} MB; is it the right file?")
    return path.read_text(encoding="utf-8-sig", errors="replace").splitlines()


def _rows(
    lines: Iterable[str], columns: tuple[str, ...], stats: LinkStats, *, time_column: str, delimiter: str
) -> Iterator[tuple[int, tuple[float, ...]]]:
    """Yield (nanoseconds since the first midnight, values) of each usable row: later than the one before, and no repetition."""
    source = iter(lines)
    titles = [title.strip() for title in next(source, "").split(delimiter)]
    missing = [name for name in (time_column, *columns) if name not in titles]
    if missing:
        raise BadDeviceData(f"no column {', '.join(map(repr, missing))} in the first line; it has {', '.join(titles)[:500]}")
    time_index = titles.index(time_column)
    indices = [titles.index(name) for name in columns]
    day_ns = 0
    last: tuple[int, tuple[float, ...]] | None = None
    for line in source:
        row = _row(line.split(delimiter), time_index, indices)
        if row is None:
            stats.rejected[Rejection.BAD_FIELDS] += bool(line.strip())
            continue
        t_ns, values = row[0] + day_ns, row[1]
        if last is not None and t_ns < last[0] - _DAY_NS // 2:  # past midnight
            day_ns += _DAY_NS
            t_ns += _DAY_NS
        if last is not None and t_ns <= last[0] + _REPEAT_NS and values == last[1] and t_ns >= last[0]:
            stats.rejected[Rejection.DUPLICATE] += 1
        elif last is not None and t_ns <= last[0]:
            stats.rejected[Rejection.NOT_ADVANCING] += 1
        else:
            last = (t_ns, values)
            yield last


def _row(cells: list[str], time_index: int, indices: list[int]) -> tuple[int, tuple[float, ...]] | None:
    if len(cells) <= max(time_index, *indices):
        return None
    time = _TIME.fullmatch(cells[time_index].strip())
    texts = [cells[index].strip().replace(",", ".") for index in indices]
    if time is None or not all(_NUMBER.fullmatch(text) for text in texts):
        return None
    hours, minutes, seconds, milliseconds = map(int, time.groups())
    values = tuple(map(float, texts))
    if hours > 23 or minutes > 59 or seconds > 60 or not all(map(math.isfinite, values)):
        return None
    return (((hours * 60 + minutes) * 60 + seconds) * 1000 + milliseconds) * _NS_PER_MS, values
