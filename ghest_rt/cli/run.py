"""`ghest-rt run`: the service on the devices of a station."""

import logging
import time
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from ghest_rt.cli.console import printing
from ghest_rt.cli.live import LiveFacts, LiveView
from ghest_rt.cli.options import Method, Movement
from ghest_rt.cli.publishing import Publishing
from ghest_rt.cli.report import print_reports, report_of
from ghest_rt.cli.scoreboard import Scoreboard
from ghest_rt.config.devices import SimBackend
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.station import StationConfig
from ghest_rt.errors import BadInputError, DeviceError, GhestError
from ghest_rt.estimation.pipeline import Pipeline, lag_ns_of
from ghest_rt.extras import need_extra
from ghest_rt.messages.published import InputState
from ghest_rt.service.clocks import ScaledClock
from ghest_rt.service.compose import AnglesComposer, Numbering
from ghest_rt.service.contract import ServiceSettings, ServiceSummary
from ghest_rt.service.devices import make_devices, uses_simulation
from ghest_rt.service.loop import Service
from ghest_rt.service.notify import service_manager
from ghest_rt.service.outputs import Output
from ghest_rt.service.run import run_service
from ghest_rt.service.station_check import check_station
from ghest_rt.service.stop_signals import StopSignals
from ghest_rt.vision.station import Method as PipelineMethod

if TYPE_CHECKING:
    from ghest_rt.cli.recording import LiveRecording, RecordOptions
    from ghest_rt.cli.sim_world import LiveWorld
    from ghest_rt.service.metrics import MetricsEndpoint

_SIM_LEAD_NS = 1_000_000_000  # from building the simulated clinic to the first movement


@dataclass(frozen=True, slots=True)
class RunOptions:
    """What the command line asks for.

    Attributes:
        station: Station file.
        method: Overrides the station file's.
        listen: Zenoh endpoint instead of the station file's.
        publish: Whether to publish at all.
        duration_s: Stop after this long; None for ever.
        as_json: The summary as JSON.
        movement: What a simulated patient does.
        seed: Of the simulation.
        record: Where and how everything is recorded; None for not at all.
    """

    station: Path
    method: Method | None
    listen: str | None
    publish: bool
    duration_s: float | None
    as_json: bool
    movement: Movement
    seed: int
    record: "RecordOptions | None" = None


def run_station(options: RunOptions) -> None:
    """Run the service on a station's devices and print what it came to.

    Raises:
        GhestError: The station file, a device's backend or the endpoint cannot be used.
        DeviceError: With a duration: a device delivered nothing all along.
    """
    manager = service_manager()
    station = load_station(options.station)
    _refuse_replay(station.config, options.station)
    method: PipelineMethod = options.method.value if options.method is not None else station.config.estimator.method
    check_station(station, method=method, publish=options.publish, listen=options.listen)
    clock = ScaledClock()
    world = _world(station, options, clock.now_ns() + _SIM_LEAD_NS)
    if world is not None:
        station = world.station
    config = station.config
    cameras, encoders = make_devices(station, clock, world.device_settings if world is not None else {})
    scoreboard = world.scoreboard if world is not None else Scoreboard()
    with (
        StopSignals() as stop,
        Publishing(config.publisher, options.listen, options.publish, False, options.station.parent) as publishing,
        _recording(options, station, clock) as recording,
        _metrics(config) as metrics,
    ):
        facts = LiveFacts(config.station.id, method, publishing.endpoints, f"ghest/{config.station.id}/gh/angles")
        publisher = publishing.publisher_for(config)
        console = Console(stderr=True) if options.as_json else Console()
        # systemd shows the state itself.
        level = logging.DEBUG if manager.present else logging.INFO
        with LiveView(console, facts, scoreboard, level) as view, manager:
            outputs: list[Output] = [output for output in (publisher, world, metrics) if output is not None]
            if recording is not None:
                cameras, encoders = recording.tap(cameras, encoders)
                outputs.append(recording.output)
            service = Service(
                settings=ServiceSettings(config.rate_hz, lag_ns_of(config, method)),
                cameras=cameras,
                encoders=encoders,
                make_pipeline=lambda infos, joints: Pipeline(station, infos, joints, method),
                composer=AnglesComposer(
                    config.station.arm,
                    method,
                    config.calibration.id,
                    time.time_ns() - clock.now_ns(),
                    Numbering(),
                    joint=config.joint,
                ),
                outputs=(*outputs, view, manager),
                clock=clock,
            )
            if recording is not None:
                recording.output.attach(service)
            summary = run_service(service, stop, options.duration_s)
    counts = recording.counts() if recording is not None else None
    with printing():
        print_reports(Console(), [report_of(config.station.id, method, summary, scoreboard)], options.as_json, counts)
    if world is not None and world.slowness and not options.as_json:
        with printing():
            Console().print(f"{config.station.id}: {world.slowness}", highlight=False)
    if counts is not None and counts.failure:
        raise GhestError(f"the recording is not complete: {counts.failure}")
    if options.duration_s is not None and world is None and not stop.is_set():
        _refuse_absent(summary, options)


def _refuse_absent(summary: ServiceSummary, options: RunOptions) -> None:
    """End a run of fixed length in which a device was never there with the exit code for that.

    Without a fixed length the service waits for devices as long as it runs, whoever restarts it or not.
    """
    silent = {name: counters.state for name, counters in summary.inputs.items() if not counters.received}
    # The others are opened, and read only once every input is there.
    absent = [name for name, state in silent.items() if state in (InputState.LOST, InputState.SILENT)] or list(silent)
    if absent:
        raise DeviceError(
            f"{options.station}: {', '.join(absent)} delivered nothing in {options.duration_s:g} s; "
            f"ghest-rt doctor --station {options.station} says what is missing"
        )


def _refuse_replay(config: StationConfig, path: Path) -> None:
    devices = {f"cameras.{name}": camera.device for name, camera in config.cameras.items()}
    for key, device in {**devices, "encoders": config.encoders.device}.items():
        if device.backend == "replay":
            raise BadInputError(f"{path}: {key}.device.backend is replay; use ghest-rt --replay RECORDING --station {path}")


# What follows is imported only where it is wanted: after a crash every tenth of a second counts.


def _recording(
    options: RunOptions, station: LoadedStation, clock: ScaledClock
) -> "AbstractContextManager[LiveRecording | None]":
    if options.record is None:
        return nullcontext()
    from ghest_rt.cli.recording import live_recording  # noqa: PLC0415

    return live_recording(options.record, station, clock)


def _metrics(config: StationConfig) -> "AbstractContextManager[MetricsEndpoint | None]":
    address = config.metrics.address
    if address is None:
        return nullcontext()
    from ghest_rt.service.metrics import MetricsEndpoint  # noqa: PLC0415

    return MetricsEndpoint(config.station.id, address)


def _world(station: LoadedStation, options: RunOptions, start_ns: int) -> "LiveWorld | None":
    device = station.config.cameras["r0"].device
    if not uses_simulation(station) or not isinstance(device, SimBackend):
        return None
    need_extra("sim", "a simulated station")
    from ghest_rt.cli.sim_world import LiveWorld  # noqa: PLC0415  (needs the extra `sim`)
    from ghest_rt.simulation.options import SimulateOptions  # noqa: PLC0415

    return LiveWorld(
        SimulateOptions(
            out=Path(),
            movement=options.movement.value,
            sensor=device.sensor,
            seed=options.seed,
            arm=station.config.station.arm,
            station=options.station,
        ),
        start_ns,
    )
