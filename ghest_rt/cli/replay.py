"""`ghest-rt --replay`: the service from recordings."""

import logging
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from ghest_drivers.replay import ReplayPlayer
from ghest_drivers.samples import CameraInfo, EncoderInfo
from ghest_rt.cli.console import printing
from ghest_rt.cli.live import LiveFacts, LiveView
from ghest_rt.cli.options import Method
from ghest_rt.cli.publishing import Publishing
from ghest_rt.cli.report import RunReport, print_reports, report_of
from ghest_rt.cli.scoreboard import Scoreboard
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.station import Publisher
from ghest_rt.errors import BadInputError
from ghest_rt.estimation.offline import estimate_events
from ghest_rt.estimation.pipeline import Pipeline, lag_ns_of
from ghest_rt.recording.reader import Recording, open_recordings
from ghest_rt.service.clocks import ScaledClock
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.contract import ServiceSettings
from ghest_rt.service.inputs import InputSettings
from ghest_rt.service.loop import Service
from ghest_rt.service.notify import ServiceManager, service_manager
from ghest_rt.service.outputs import Output
from ghest_rt.service.run import run_service
from ghest_rt.service.stop_signals import StopSignals
from ghest_rt.service.unpaced import publish_all
from ghest_rt.vision.photometric.edge_profile import BLURS_PX, profile_of

_log = logging.getLogger(__name__)

_SLOWEST, _FASTEST = 0.05, 20.0


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """What the command line asks for.

    Attributes:
        path: Recording, or folder of recordings.
        speed: A factor, or "max".
        loop: Again and again.
        method: Overrides the station file's.
        station: Station file instead of the recording's own.
        listen: Zenoh endpoint instead of the station file's.
        publish: Whether to publish at all.
        as_json: The summary as JSON.
    """

    path: Path
    speed: str
    loop: bool
    method: Method | None
    station: Path | None
    listen: str | None
    publish: bool
    as_json: bool


def parse_speed(text: str) -> float | None:
    """Return the factor, or None for "max".

    Raises:
        BadInputError: Neither "max" nor a sensible number.
    """
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not _SLOWEST <= speed <= _FASTEST:
        raise BadInputError(f"--speed {text}: give a number from {_SLOWEST:g} to {_FASTEST:g}, or max")
    return speed


def replay_path(options: ReplayOptions) -> None:
    """Replay a recording, or a folder of them, through the service and print what it came to.

    Raises:
        GhestError: A recording, the station file or the endpoint cannot be used.
    """
    speed = parse_speed(options.speed)
    station = load_station(options.station) if options.station is not None else None
    recordings = open_recordings(options.path)
    reports: list[RunReport] = []
    with StopSignals() as stop, ExitStack() as stack, service_manager() as manager:
        config = (station or recordings[0].station).config
        # A recording, which may come from anywhere, does not say where it is published.
        settings = Publisher() if options.station is None else config.publisher
        folder = Path() if options.station is None else options.station.parent
        publishing = stack.enter_context(Publishing(settings, options.listen, options.publish, speed is None, folder))
        player = _Replayer(options, speed, publishing, manager, stop)
        while True:
            reports.extend(
                player.replay(recording, station or recording.station) for recording in recordings if not stop.is_set()
            )
            if stop.is_set() or not options.loop:
                break
            del reports[: -len(recordings)]  # a display that runs for days tells of the last round
    with printing():
        print_reports(Console(), reports, options.as_json)


class _Replayer:
    """Plays one recording after the other with the same outputs and one numbering."""

    def __init__(
        self,
        options: ReplayOptions,
        speed: float | None,
        publishing: Publishing,
        manager: ServiceManager,
        stop: StopSignals,
    ) -> None:
        self._options = options
        self._speed = speed
        self._publishing = publishing
        self._manager = manager
        self._stop = stop
        self._numbering = Numbering()
        # With --json standard output belongs to the document at the end.
        self._console = Console(stderr=True) if options.as_json else Console()

    def replay(self, recording: Recording, station: LoadedStation) -> RunReport:
        """Play a recording to its end or until a signal comes."""
        _log.info("replaying %s", recording.path)
        config = station.config
        method = self._options.method.value if self._options.method is not None else config.estimator.method
        publisher = self._publishing.publisher_for(config)
        facts = LiveFacts(
            title=f"{config.station.id} · {recording.path.name}",
            method=method,
            endpoints=self._publishing.endpoints,
            key=f"ghest/{config.station.id}/gh/angles",
        )
        play = self._unpaced if self._speed is None else self._paced
        report = play(recording, station, facts, () if publisher is None else (publisher,))
        for problem in recording.problems:
            _log.warning("%s: %s", recording.path, problem)
        return report

    def _paced(self, recording: Recording, station: LoadedStation, facts: LiveFacts, outputs: tuple[Output, ...]) -> RunReport:
        # What happens once and takes long, before the clock runs: frames would be late for it.
        for blur_px in BLURS_PX:
            profile_of(blur_px)
        self._pipeline(station, recording.camera_infos, recording.encoder_joints)
        clock = ScaledClock(self._speed or 1.0)
        scoreboard = Scoreboard()
        player = ReplayPlayer(
            recording.events(),
            recording.camera_infos,
            EncoderInfo("encoders", recording.encoder_joints),
            clock,
            on_other=scoreboard.truth,
        )
        scoreboard.set_time_axis(player.to_recording_ns)
        config = station.config
        with LiveView(self._console, facts, scoreboard) as view:
            try:
                service = Service(
                    settings=ServiceSettings(
                        rate_hz=config.rate_hz,
                        lag_ns=lag_ns_of(config, facts.method),
                        inputs=InputSettings(reconnect=False),
                    ),
                    cameras={name: player.camera(name) for name in recording.camera_infos},
                    encoders=player.encoders(),
                    make_pipeline=lambda infos, joints: self._pipeline(station, infos, joints),
                    composer=self._composer(station, facts.method, time.time_ns() - clock.now_ns()),
                    outputs=(*outputs, scoreboard, view, self._manager),
                    clock=clock,
                )
                summary = run_service(service, self._stop)
            finally:
                player.close()
        return report_of(recording.path.name, facts.method, summary, scoreboard, problems=recording.problems)

    def _unpaced(
        self, recording: Recording, station: LoadedStation, facts: LiveFacts, outputs: tuple[Output, ...]
    ) -> RunReport:
        scoreboard = Scoreboard()
        pipeline = self._pipeline(station, recording.camera_infos, recording.encoder_joints)

        def events() -> Iterator[object]:
            for event in recording.events():
                scoreboard.truth(event)
                yield event

        with LiveView(self._console, facts, scoreboard) as view:
            counts = publish_all(
                estimate_events(events(), pipeline, t_0_ns=recording.grid_t_0_ns),
                self._composer(station, facts.method, 0),
                pipeline.lag_ns,
                (*outputs, scoreboard, view, self._manager),
                self._stop,
            )
        return report_of(
            recording.path.name, facts.method, counts, scoreboard, problems=recording.problems, unused=pipeline.counts()
        )

    def _pipeline(self, station: LoadedStation, infos: dict[str, CameraInfo], joints: tuple[str, ...]) -> Pipeline:
        method = self._options.method
        return Pipeline(station, infos, joints, None if method is None else method.value)

    def _composer(self, station: LoadedStation, method: str, unix_offset_ns: int) -> AnglesComposer:
        config = station.config
        return AnglesComposer(
            config.station.arm, method, config.calibration.id, unix_offset_ns, self._numbering, joint=config.joint
        )
