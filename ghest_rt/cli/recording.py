"""`ghest-rt record`: what is added to a run so that everything its devices deliver is recorded."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from rich.console import Console

from ghest_drivers.clock import Clock
from ghest_drivers.interfaces import EncoderLink, RgbdCamera
from ghest_rt.config.load import LoadedStation
from ghest_rt.security.sealing import check_recipients
from ghest_rt.security.subjects import check_subject
from ghest_rt.service.recorder import Recorder
from ghest_rt.service.recorder_parts import Parts
from ghest_rt.service.recorder_settings import RecorderCounts, RecorderSettings, drops_in_words
from ghest_rt.service.recorder_taps import RecordedCamera, RecordedEncoders, RecorderOutput


@dataclass(frozen=True, slots=True)
class RecordOptions:
    """What the command line asks for.

    Attributes:
        folder: Where the files go.
        part_bytes: Size at which another file begins.
        part_ns: Time after which another file begins.
        compress: Smaller files for more processor time.
        encrypt_to: Public keys that the files are sealed for, beside those of the station file.
        subject: Pseudonym of the patient, written into the files.
    """

    folder: Path
    part_bytes: int
    part_ns: int
    compress: bool
    encrypt_to: tuple[str, ...] = ()
    subject: str | None = None


class LiveRecording:
    """A recorder between the devices of a run and its service.

    Raises:
        BadInputError: The folder or a file in it cannot be written.
    """

    def __init__(self, options: RecordOptions, station: LoadedStation, clock: Clock) -> None:
        recipients = tuple(dict.fromkeys((*station.config.recorder.encrypt_to, *options.encrypt_to)))
        if recipients:
            check_recipients(recipients)
        settings = RecorderSettings(
            part_bytes=options.part_bytes, part_ns=options.part_ns, compress=options.compress, recipients=recipients
        )
        facts = {"created_by": f"ghest-rt {version('ghest-rt')}", "command": "ghest-rt record"}
        if options.subject is not None:
            facts["subject"] = check_subject(options.subject)
        parts = Parts(options.folder, station, facts, settings, started_unix_ns=time.time_ns(), now_ns=clock.now_ns())
        self._recorder = Recorder(parts, settings, clock)
        self._recorder.start()
        self.output = RecorderOutput(self._recorder)

    def tap(self, cameras: Mapping[str, RgbdCamera], encoders: EncoderLink) -> tuple[dict[str, RgbdCamera], EncoderLink]:
        """Return the devices to run the service on instead of these."""
        tapped: dict[str, RgbdCamera] = {name: RecordedCamera(camera, self._recorder) for name, camera in cameras.items()}
        return tapped, RecordedEncoders(encoders, self._recorder)

    def counts(self) -> RecorderCounts:
        """Return what has been recorded."""
        return self._recorder.counts()

    def close(self) -> None:
        """Finish the files."""
        self._recorder.close()


@contextmanager
def live_recording(options: RecordOptions | None, station: LoadedStation, clock: Clock) -> Iterator[LiveRecording | None]:
    """Record while entered; without options, not at all.

    Raises:
        BadInputError: The folder or a file in it cannot be written.
    """
    if options is None:
        yield None
        return
    recording = LiveRecording(options, station, clock)
    try:
        yield recording
    finally:
        recording.close()


def recorded_document(counts: RecorderCounts) -> dict[str, object]:
    """Return what was recorded, for JSON."""
    return {
        "files": [str(path) for path in counts.parts],
        "megabytes": counts.written_bytes / 1e6,
        "written": counts.written,
        "dropped": counts.dropped,
        "longest_wait_ms": counts.max_wait_ns / 1e6,
        "failure": counts.failure or None,
    }


def print_recorded(console: Console, counts: RecorderCounts) -> None:
    """Print what was recorded."""
    files = str(counts.parts[0]) if len(counts.parts) == 1 else f"{len(counts.parts)} files, {counts.parts[0]} and on"
    dropped = drops_in_words(counts.dropped)
    how = f"dropped {dropped}" if dropped else "nothing dropped"
    console.print(f"recorded {counts.written_bytes / 1e6:.0f} MB in {files}; {how}")
