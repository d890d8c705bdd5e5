"""`ghest-rt simulate`: record a simulated session, sensors and truth, to a file."""

import os
import shlex
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

from ghest_drivers.samples import RgbdFrame
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.recording.writer import RecordingWriter
from ghest_rt.simulation.building import stage_world
from ghest_rt.simulation.faults import FaultyDevices
from ghest_rt.simulation.options import HEIGHT_M, SimulateOptions
from ghest_rt.simulation.staged import StagedWorld

_LOOK_AHEAD = 6


@dataclass(frozen=True, slots=True)
class SimulationSummary:
    """What was recorded.

    Attributes:
        out: The recording.
        motion: Name of the movement.
        duration_s: Length of the movement recorded.
        frames: Frames of each camera.
        encoder_samples: Encoder rows.
        truth_samples: Samples of the truth.
        size_bytes: Size of the recording.
    """

    out: Path
    motion: str
    duration_s: float
    frames: dict[str, int]
    encoder_samples: int
    truth_samples: int
    size_bytes: int


def simulate(options: SimulateOptions, progress: Callable[[float], None]) -> SimulationSummary:
    """Record a simulated session. `progress` hears the fraction done, 0-1, now and then.

    The recording appears whole or not at all: what an interruption or an error leaves half-way is removed.

    Raises:
        BadInputError: An option, the station file, the motion file or the output path cannot be used.
        GhestError: The exoskeleton cannot follow the movement, or the disk is full or gone.
    """
    _check_out(options.out)
    world = stage_world(options)
    devices = FaultyDevices(options.faults, world.camera_names, options.seed, world.timeline.duration_s)
    name = world.motion_name
    facts = {
        "created_by": f"ghest-rt {version('ghest-rt')}",
        "command": _command(options, name),
        "motion": name,
        "sensor": options.sensor,
        "seed": str(options.seed),
        "height_m": str(options.height_m),
        **_disturbances(options),
    }
    deliveries = {camera: _deliveries(world, devices, camera) for camera in world.camera_names}
    for camera, given in deliveries.items():
        if not given:
            raise BadInputError(f"camera {camera} would deliver no frame at all: drop fewer (--fault), or simulate longer")
    part = options.out.with_name(f"{options.out.name}.{os.getpid()}.part")
    try:
        with RecordingWriter(part, world.station, facts) as writer:
            rows = _write(writer, world, devices, deliveries, progress)
        part.replace(options.out)
    except (GhestError, OSError) as error:
        cause = error if isinstance(error, OSError) else error.__cause__
        if not isinstance(cause, OSError):
            raise
        kind = type(error) if isinstance(error, GhestError) else GhestError
        raise kind(f"{options.out}: cannot write the recording: {cause.strerror or cause}; nothing is left of it") from error
    finally:
        part.unlink(missing_ok=True)
    progress(1.0)
    return SimulationSummary(
        out=options.out,
        motion=name,
        duration_s=world.timeline.duration_s,
        frames={camera: len(given) for camera, given in deliveries.items()},
        encoder_samples=rows,
        truth_samples=len(world.truth_times_ns),
        size_bytes=options.out.stat().st_size,
    )


def _check_out(out: Path) -> None:
    if out.suffix != ".mcap":
        raise BadInputError(f"--out {out}: a recording ends in .mcap; name it so")
    if out.is_dir():
        raise BadInputError(f"--out {out}: is a folder; name a file")
    if not out.parent.is_dir():
        raise BadInputError(f"--out {out}: cannot write the recording: no such folder; make {out.parent} first")


def _write(
    writer: RecordingWriter,
    world: StagedWorld,
    devices: FaultyDevices,
    deliveries: dict[str, list["_Delivery"]],
    progress: Callable[[float], None],
) -> int:
    """Write what the devices deliver, and the truth; return how many encoder rows there are."""
    first_ns = min(world.encoder_arrival_ns(0), world.truth_times_ns[0])
    events = _events(world, deliveries)
    with ThreadPoolExecutor(max_workers=len(world.camera_names)) as pool:
        for camera in world.camera_names:
            writer.add_camera(world.camera_info(camera), first_ns, with_depth=world.station.config.cameras[camera].depth)
        frames = {camera: _render_ahead(world, devices, camera, given, pool) for camera, given in deliveries.items()}
        names = world.encoder_info().joint_names
        rows = 0
        for done, (_, kind, k) in enumerate(events):
            if kind == "truth":
                writer.write_truth(world.truth_at(world.truth_times_ns[k]))
            elif kind == "encoders":
                sample = world.encoder_sample(k)
                if sample is not None and devices.delivers_encoders(world.timeline.movement_s(sample.t_capture_ns)):
                    rows += 1
                    writer.write_encoder(sample, names)
            else:
                writer.write_frame(next(frames[kind]))
                progress(done / len(events))
    return rows


@dataclass(frozen=True, slots=True)
class _Delivery:
    """A frame that is delivered: its number and when."""

    k: int
    arrival_ns: int


def _deliveries(world: StagedWorld, devices: FaultyDevices, camera: str) -> list[_Delivery]:
    """Return the frames that a camera delivers, in their order: behind a late one the next wait."""
    deliveries: list[_Delivery] = []
    latest_ns = 0
    for k in range(world.frame_count(camera)):
        if devices.delivers_frame(camera, k):
            on_time_ns = world.frame_times(camera, k).arrival_ns
            latest_ns = max(latest_ns, on_time_ns + round(devices.delay_s(camera, k) * 1e9))
            deliveries.append(_Delivery(k, latest_ns))
    return deliveries


def _events(world: StagedWorld, deliveries: dict[str, list[_Delivery]]) -> list[tuple[int, str, int]]:
    """Return (arrival time, source, number) of everything to be written, in order of arrival."""
    events = [(t_ns, "truth", k) for k, t_ns in enumerate(world.truth_times_ns)]
    events += [(world.encoder_arrival_ns(k), "encoders", k) for k in range(world.encoder_count)]
    for camera, given in deliveries.items():
        events += [(delivery.arrival_ns, camera, delivery.k) for delivery in given]
    return sorted(events)


def _render_ahead(
    world: StagedWorld, devices: FaultyDevices, camera: str, deliveries: Sequence[_Delivery], pool: ThreadPoolExecutor
) -> Iterator[RgbdFrame]:
    """Yield a camera's frames in order, one after another on the pool, a few ahead of the writer."""

    def render(first: int) -> list[RgbdFrame]:
        block: list[RgbdFrame] = []
        for delivery in deliveries[first : first + _LOOK_AHEAD]:
            frame = world.frame(camera, delivery.k)
            if frame is not None:
                frame = replace(frame, t_arrival_ns=delivery.arrival_ns)
                block.append(devices.spoil(frame, world.timeline.movement_s(frame.t_capture_ns)))
        return block

    waiting: deque[Future[list[RgbdFrame]]] = deque()
    starts = iter(range(0, len(deliveries), _LOOK_AHEAD))
    for start in starts:
        waiting.append(pool.submit(render, start))
        break
    while waiting:
        block = waiting.popleft().result()
        for start in starts:
            waiting.append(pool.submit(render, start))
            break
        yield from block


def _disturbances(options: SimulateOptions) -> dict[str, str]:
    """Return the recording's facts about what goes wrong: none if nothing does."""
    given: dict[str, list[str]] = {
        "marker_shift": [move.text for move in options.marker_moves if move.kind == "shift"],
        "marker_turn": [move.text for move in options.marker_moves if move.kind == "turn"],
        "soft_tissue": [] if options.soft_tissue == "none" else [options.soft_tissue],
        "fault": [fault.text for fault in options.faults],
        "image": list(options.imaging.texts),
    }
    return {name: " ".join(texts) for name, texts in given.items() if texts}


def _command(options: SimulateOptions, motion_name: str) -> str:
    """Return the command that makes this recording again, without folders, so that it does not depend on where it ran."""
    words = ["ghest-rt", "simulate"]
    if options.motion is not None:
        words += ["--motion", options.motion.name]
    elif options.movement is not None:
        words += ["--movement", motion_name]
    if options.station is not None:
        words += ["--station", options.station.name]
    words += ["--sensor", options.sensor, "--seed", str(options.seed)]
    if options.duration_s is not None:
        words += ["--duration", f"{options.duration_s:g}"]
    if options.arm != "right":
        words += ["--arm", options.arm]
    if options.height_m != HEIGHT_M:
        words += ["--height", f"{options.height_m:g}"]
    if options.marker != "disks":
        words += ["--marker", options.marker]
    if options.color_only:
        words.append("--color-only")
    if options.calibration_reference:
        words.append("--calibration-reference")
    for move in options.marker_moves:
        words += [f"--marker-{move.kind}", move.text]
    if options.soft_tissue != "none":
        words += ["--soft-tissue", options.soft_tissue]
    for fault in options.faults:
        words += ["--fault", fault.text]
    for text in options.imaging.texts:
        words += ["--image", text]
    return shlex.join([*words, "--out", options.out.name])
