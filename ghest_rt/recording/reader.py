"""Read recordings (docs/recording-format.md). They come from anywhere: nothing in them is trusted."""

from collections.abc import Iterator
from pathlib import Path

from ghest_drivers.samples import CameraInfo
from ghest_rt.config.load import LoadedStation, parse_station
from ghest_rt.errors import BadInputError
from ghest_rt.recording import layout
from ghest_rt.recording.blocks import complete_channels, messages_by_arrival, messages_by_place
from ghest_rt.recording.decoding import Event, EventDecoder
from ghest_rt.recording.opening import read_opening
from ghest_rt.recording.problems import Problem, ProblemLog, Skip
from ghest_rt.recording.scan import Block, Scan, scan_file
from ghest_rt.recording.streams import Kind, find_streams
from ghest_rt.security.sealing import SEALED_SUFFIX

_MAX_TEXT_BYTES = 1_000_000


class Recording:
    """One recording, checked. It holds no open file; `events` may be asked for more than once.

    Attributes:
        path: The file.
        facts: The free facts written with it, and `format`.
        grid_t_0_ns: An instant of the grid on which angles were published while it was recorded; None if none were.
        station: The station file and URDF it carries.
        camera_infos: By name, for every camera of the station file.
        encoder_joints: The joints measured, in the order of `EncoderSample.angles_rad`.
        has_truth: Whether there is ground truth.
        duration_ns: From the first message's arrival to the last one's.

    Raises:
        BadInputError: It cannot be used at all; says where and why. A file that is cut off can be used up to the cut.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        scan = scan_file(path)
        self.facts = _facts(path, scan)
        self.grid_t_0_ns = _grid(scan)
        self.station = _station(path, scan)
        damaged: dict[int, str] = {}  # by byte; reported with the events, if it does not keep the recording from being opened
        try:
            complete_channels(path, scan)
            self._streams = find_streams(path, scan, self.station.config.cameras)
            messages = messages_by_place(path, scan.blocks, lambda block, why: damaged.__setitem__(block.byte, why))
            self._opening = read_opening(path, scan, self._streams, messages)
        except OSError as error:
            raise _unreadable(path, error) from error
        except BadInputError as error:
            if not damaged:
                raise
            chunks = "1 chunk" if len(damaged) == 1 else f"{len(damaged)} chunks"
            first = min(damaged)
            raise BadInputError(f"{error}; {chunks} damaged up to there (first at byte {first}: {damaged[first]})") from error
        self.camera_infos: dict[str, CameraInfo] = self._opening.cameras
        self.encoder_joints = self._opening.joints
        unknown = [joint for joint in self.station.config.encoders.joints if joint not in self.encoder_joints]
        if unknown:
            raise BadInputError(
                f"{path}: the samples on {layout.ENCODER_TOPIC} lack {', '.join(unknown)}, "
                "named by encoders.joints of the station file in the recording; correct one of them"
            )
        self.has_truth = any(stream.kind is Kind.TRUTH for stream in self._streams.values())
        self._blocks = scan.blocks
        self.duration_ns = max(b.end_ns for b in self._blocks) - min(b.start_ns for b in self._blocks)
        self._file_log = ProblemLog()
        if not scan.whole:
            last_ns = max(block.end_ns for block in self._blocks)
            detail = f"{scan.cut_reason}; used up to there, the rest is lost"
            self._file_log.add(Skip.TRUNCATED, "", scan.cut_byte, last_ns, detail)
        self._events_log = ProblemLog()

    @property
    def problems(self) -> list[Problem]:
        """What was left out: of the file as a whole, and in the last pass of `events` so far."""
        return self._file_log.list() + self._events_log.list()

    def events(self) -> Iterator[Event]:
        """Yield frames, encoder samples and truth in the order of arrival (truth: of its time).

        Arrays are read-only and mostly views into what was read. Not to be iterated twice at the same time.

        Raises:
            BadInputError: The file cannot be read any more.
        """
        log = self._events_log = ProblemLog()
        decoder = EventDecoder(self._streams, self._opening, log)

        def on_damage(block: Block, detail: str) -> None:
            log.add(Skip.DAMAGED_CHUNK, "", block.byte, block.start_ns, detail)

        try:
            for message in messages_by_arrival(self.path, self._blocks, on_damage):
                event = decoder.decode(message)
                if event is not None:
                    yield event
        except OSError as error:
            raise _unreadable(self.path, error) from error
        decoder.finish()


def open_recordings(path: Path) -> list[Recording]:
    """Open a recording, or all `*.mcap` files of a folder by name.

    Raises:
        BadInputError: No such file or folder, no recording in it, or one that cannot be used.
    """
    return [Recording(file) for file in files_of(path)]


def files_of(path: Path) -> list[Path]:
    """Return a file itself, or all `*.mcap` files of a folder by name.

    Raises:
        BadInputError: There is none in the folder.
    """
    if not path.is_dir():
        return [path]
    files = sorted(file for file in path.glob("*.mcap") if file.is_file())
    if not files:
        if any(path.glob(f"*.mcap{SEALED_SUFFIX}")):
            raise BadInputError(f"{path}: only sealed recordings in this folder; ghest-rt decrypt {path} --key FILE opens them")
        raise BadInputError(f"{path}: no recording (*.mcap) in this folder; name a file or another folder")
    return files


def _facts(path: Path, scan: Scan) -> dict[str, str]:
    facts = scan.metadata.get(layout.FACTS)
    if facts is None:
        raise BadInputError(
            f"{path}: not a ghest recording: no metadata record {layout.FACTS!r}{_cut(scan)}; see docs/recording-format.md"
        )
    version = facts.get("format", "")
    if version != layout.FORMAT_VERSION:
        raise BadInputError(
            f"{path}: recording format {version!r}, this program reads {layout.FORMAT_VERSION!r}; use the program that wrote it"
        )
    return facts


def _grid(scan: Scan) -> int | None:
    text = scan.metadata.get(layout.GRID, {}).get(layout.GRID_T_0_NS, "")
    return int(text) if text.isdecimal() and len(text) < 20 else None


def _station(path: Path, scan: Scan) -> LoadedStation:
    texts = []
    for name in (layout.STATION_ATTACHMENT, layout.URDF_ATTACHMENT):
        place = f"{path}: attachment {name}"
        data = scan.attachments.get(name)
        if data is None:
            raise BadInputError(f"{place} is missing{_cut(scan)}; write it before the first message")
        if len(data) > _MAX_TEXT_BYTES:
            raise BadInputError(f"{place} is larger than {_MAX_TEXT_BYTES} bytes; is it the right file?")
        try:
            texts.append(data.decode())
        except UnicodeDecodeError as error:
            raise BadInputError(f"{place} is not UTF-8 text (byte {error.start} of it)") from error
    source = f"{path}: attachment {layout.STATION_ATTACHMENT}"
    return LoadedStation(parse_station(texts[0], source), texts[0], texts[1], source)


def _cut(scan: Scan) -> str:
    return "" if scan.whole else f" before byte {scan.cut_byte}, where the file is cut off"


def _unreadable(path: Path, error: OSError) -> BadInputError:
    return BadInputError(f"{path}: cannot read the recording: {error.strerror or error}")
