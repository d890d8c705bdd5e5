"""A live recording as a row of files, each a whole recording by itself."""

import os
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from ghest_drivers.samples import CameraInfo
from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.recording.writer import RecordingWriter
from ghest_rt.security.sealing import SEALED_SUFFIX
from ghest_rt.service.camera_worker import same_camera
from ghest_rt.service.recorder_settings import RecorderSettings
from ghest_rt.service.recorder_sync import DiskSync

_ALIVE_NS = 250_000_000  # an input that delivered within this time will deliver into the next part, too


class Parts:
    """Writes to the newest file and begins the next one when that has become large or long enough. For one thread.

    The files are called `<station>-<start, UTC>-<number>.mcap`, with `.age` if they are sealed. A part begins
    while every input is delivering, so that none lacks a stream: during the outage of an input a part grows beyond its limits.

    Args:
        folder: Where the files go; made if it does not exist.
        station: Carried along in every part.
        facts: Carried along in every part; `part`, `clock_offset_unix_ns` and `recorded_live` are added.
        settings: Sizes and times.
        started_unix_ns: Start of the run, for the names.
        now_ns: The clock of the samples.

    Raises:
        BadInputError: The folder or a file in it cannot be written.
    """

    def __init__(
        self,
        folder: Path,
        station: LoadedStation,
        facts: Mapping[str, str],
        settings: RecorderSettings,
        *,
        started_unix_ns: int,
        now_ns: int,
    ) -> None:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadInputError(
                f"{folder}: cannot write recordings here: {error.strerror or error}; name another folder"
            ) from error
        start = datetime.fromtimestamp(started_unix_ns * 1e-9, UTC)
        self._stem = folder / f"{station.config.station.id}-{start:%Y%m%dT%H%M%SZ}"
        self._station = station
        self._facts = {**facts, "recorded_live": start.isoformat(), "clock_offset_unix_ns": str(started_unix_ns - now_ns)}
        self._settings = settings
        self._sync = DiskSync(settings.sync_ns * 1e-9)
        self._infos: dict[str, CameraInfo] = {}
        self._newest_ns: dict[str, int] = {}
        self._waiting: set[str] = set()  # inputs that have not delivered into this part yet
        self._closed_bytes = 0
        self._closed = False
        self._grid_t_0_ns: int | None = None
        self._begun_ns = now_ns
        self._flushed_s = time.monotonic()
        self.files: list[Path] = []
        self.writer = self._next_part()
        self._sync.start()

    @property
    def written_bytes(self) -> int:
        """Size of all files together."""
        return self._closed_bytes + (0 if self._closed else self.writer.size_bytes)

    def add_camera(self, info: CameraInfo, t_ns: int) -> None:
        """Note a camera's facts. If they have changed, another part begins: they hold for a whole file."""
        known = self._infos.get(info.name)
        self._infos[info.name] = info
        if known is None:
            self.writer.add_camera(info, t_ns, with_depth=self._with_depth(info.name))
        elif known is not info and not same_camera(known, info):
            self._rotate(t_ns)

    def set_grid(self, t_0_ns: int) -> None:
        """Note the grid on which samples are published; for this part and those that follow."""
        self._grid_t_0_ns = t_0_ns
        self.writer.write_grid(t_0_ns)

    def saw(self, source: str, t_arrival_ns: int) -> None:
        """Note that an input delivers; begins another part if it is time for one."""
        newest = self._newest_ns
        newest[source] = max(t_arrival_ns, newest.get(source, t_arrival_ns))
        self._waiting.discard(source)
        grown = self.writer.size_bytes >= self._settings.part_bytes or t_arrival_ns - self._begun_ns >= self._settings.part_ns
        if grown and not self._waiting and min(newest.values()) >= t_arrival_ns - _ALIVE_NS:
            self._rotate(t_arrival_ns)

    def flush_if_due(self) -> None:
        """Hand over to the operating system what is still held here.

        Raises:
            GhestError: The disk is full or gone.
        """
        if self._sync.failure is not None:
            raise GhestError(f"{self.files[-1]}: the disk does not take the recording: {self._sync.failure.strerror}")
        now_s = time.monotonic()
        if now_s - self._flushed_s >= self._settings.flush_ns * 1e-9:
            self._flushed_s = now_s
            self.writer.flush()

    def close(self) -> None:
        """Write the index of the last file and wait for the disk.

        Raises:
            GhestError: The disk is full or gone.
        """
        try:
            self.writer.close()
        finally:
            self._closed = True
            self._closed_bytes = sum(file.stat().st_size for file in self.files if file.exists())
            self._sync.stop(self._settings.drain_s)

    def _with_depth(self, camera: str) -> bool:
        return camera not in self._station.config.cameras or self._station.config.cameras[camera].depth

    def _rotate(self, t_ns: int) -> None:
        self.writer.close()
        self._closed_bytes = sum(file.stat().st_size for file in self.files)
        self._begun_ns = t_ns
        self._waiting = set(self._newest_ns)
        self.writer = self._next_part()
        for info in self._infos.values():
            self.writer.add_camera(info, t_ns, with_depth=self._with_depth(info.name))
        if self._grid_t_0_ns is not None:
            self.writer.write_grid(self._grid_t_0_ns)

    def _next_part(self) -> RecordingWriter:
        number = len(self.files)
        suffix = f".mcap{SEALED_SUFFIX}" if self._settings.recipients else ".mcap"
        path = self._stem.with_name(f"{self._stem.name}-{number:03d}{suffix}")
        if path.exists():
            raise BadInputError(f"{path}: exists already; start again, or name another folder")
        writer = RecordingWriter(
            path,
            self._station,
            {**self._facts, "part": str(number)},
            "zstd" if self._settings.compress else "none",
            self._settings.recipients,
        )
        self.files.append(path)
        self._sync.watch(writer.fileno())
        _sync_folder(path.parent)
        return writer


def _sync_folder(folder: Path) -> None:
    """Make a new file's name last, too."""
    fd = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)
