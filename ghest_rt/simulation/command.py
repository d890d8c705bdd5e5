"""`ghest-rt simulate`: record a simulated session, sensors and truth, to a file."""

import shlex
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Literal

from ghest_drivers.samples import RgbdFrame
from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.errors import BadInputError
from ghest_rt.recording.writer import RecordingWriter
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.fitting import fit_station
from ghest_rt.simulation.imaging import Light
from ghest_rt.simulation.opensim_file import read_motion_table
from ghest_rt.simulation.opensim_motion import OpenSimMotion
from ghest_rt.simulation.posture import Motion
from ghest_rt.simulation.sensors import find_sensors
from ghest_rt.simulation.texture import MarkerTexture
from ghest_rt.simulation.therapy import TherapyMotion, find_movement
from ghest_rt.simulation.world import World

_LOOK_AHEAD = 6
_STATIONS = {
    ("paper", "right"): "station-sim.toml",
    ("paper", "left"): "station-sim-left.toml",
    ("sr300", "right"): "station-sr300-sim.toml",
    ("sr300", "left"): "station-sr300-sim-left.toml",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulateOptions:
    """What to simulate.

    Attributes:
        out: The recording to write.
        movement: A movement of Table 2 by name, or None with `motion`.
        motion: An OpenSim motion file, or None with `movement`.
        sensor: "paper" or "sr300".
        seed: The same seed gives the same bytes.
        duration_s: How much of the movement; None for all of it.
        arm: Which arm.
        height_m: The patient's height.
        marker: What is printed on the marker plates.
        brightness: Factor on the light in the room.
        white_balance: Factors on red, green and blue.
        station: A station file of your own; None for the shipped one of this sensor and arm.
    """

    out: Path
    movement: str | None = None
    motion: Path | None = None
    sensor: Literal["paper", "sr300"] = "paper"
    seed: int = 0
    duration_s: float | None = None
    arm: Literal["right", "left"] = "right"
    height_m: float = 1.75
    marker: MarkerTexture = "disks"
    brightness: float = 1.0
    white_balance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    station: Path | None = None


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


def build_world(options: SimulateOptions) -> World:
    """Set up the simulated clinic that `options` describe (`out` is not used).

    Raises:
        BadInputError: An option, the station file or the motion file cannot be used.
        GhestError: The exoskeleton cannot follow the movement.
    """
    if not 0 <= options.seed < 1 << 63:
        raise BadInputError(f"seed {options.seed}: give a number that is not negative")
    if min(options.brightness, *options.white_balance) <= 0:
        raise BadInputError("brightness and white balance are factors: give positive numbers")
    sensors = find_sensors(options.sensor)
    body = anatomy(options.height_m)
    station = fit_station(_station(options), body)
    if station.config.station.arm != options.arm:
        raise BadInputError(
            f"{station.source}: station.arm is {station.config.station.arm}, asked for is the {options.arm} arm; "
            f"use --arm {station.config.station.arm} or another station file"
        )
    return World(
        station,
        body,
        _motion(options),
        sensors,
        seed=options.seed,
        texture=options.marker,
        light=Light(options.brightness, options.white_balance),
        duration_s=options.duration_s,
    )


def simulate(options: SimulateOptions, progress: Callable[[float], None]) -> SimulationSummary:
    """Record a simulated session. `progress` hears the fraction done, 0-1, now and then.

    Raises:
        BadInputError: An option, the station file, the motion file or the output path cannot be used.
        GhestError: The exoskeleton cannot follow the movement.
    """
    world = build_world(options)
    name = _motion_name(options)
    facts = {
        "created_by": f"ghest-rt {version('ghest-rt')}",
        "command": _command(options),
        "motion": name,
        "sensor": options.sensor,
        "seed": str(options.seed),
        "height_m": str(options.height_m),
    }
    first_ns = min(world.encoder_arrival_ns(0), world.truth_times_ns[0])
    events = _events(world)
    with (
        RecordingWriter(options.out, world.station, facts) as writer,
        ThreadPoolExecutor(max_workers=len(world.camera_names)) as pool,
    ):
        for camera in world.camera_names:
            writer.add_camera(world.camera_info(camera), first_ns)
        frames = {camera: _render_ahead(world, camera, pool) for camera in world.camera_names}
        names = world.encoder_info().joint_names
        for done, (_, kind, k) in enumerate(events):
            if kind == "truth":
                writer.write_truth(world.truth_at(world.truth_times_ns[k]))
            elif kind == "encoders":
                sample = world.encoder_sample(k)
                if sample is not None:
                    writer.write_encoder(sample, names)
            else:
                writer.write_frame(next(frames[kind]))
                progress(done / len(events))
    progress(1.0)
    return SimulationSummary(
        out=options.out,
        motion=name,
        duration_s=world.timeline.duration_s,
        frames={camera: world.frame_count(camera) for camera in world.camera_names},
        encoder_samples=world.encoder_count,
        truth_samples=len(world.truth_times_ns),
        size_bytes=options.out.stat().st_size,
    )


def _events(world: World) -> list[tuple[int, str, int]]:
    """Return (arrival time, source, number) of everything to be written, in order of arrival."""
    events = [(t_ns, "truth", k) for k, t_ns in enumerate(world.truth_times_ns)]
    events += [(world.encoder_arrival_ns(k), "encoders", k) for k in range(world.encoder_count)]
    for camera in world.camera_names:
        events += [(world.frame_times(camera, k).arrival_ns, camera, k) for k in range(world.frame_count(camera))]
    return sorted(events)


def _render_ahead(world: World, camera: str, pool: ThreadPoolExecutor) -> Iterator[RgbdFrame]:
    """Yield a camera's frames in order, one after another on the pool, a few ahead of the writer."""

    def render(first: int) -> list[RgbdFrame]:
        block = (world.frame(camera, k) for k in range(first, first + _LOOK_AHEAD))
        return [frame for frame in block if frame is not None]

    waiting: deque[Future[list[RgbdFrame]]] = deque()
    starts = iter(range(0, world.frame_count(camera), _LOOK_AHEAD))
    for start in starts:
        waiting.append(pool.submit(render, start))
        break
    while waiting:
        block = waiting.popleft().result()
        for start in starts:
            waiting.append(pool.submit(render, start))
            break
        yield from block


def _station(options: SimulateOptions) -> LoadedStation:
    if options.station is not None:
        return load_station(options.station)
    return load_station(shipped_config_dir() / _STATIONS[options.sensor, options.arm])


def _motion(options: SimulateOptions) -> Motion:
    if options.movement is not None and options.motion is None:
        return TherapyMotion(find_movement(options.movement), options.seed)
    if options.motion is not None and options.movement is None:
        return OpenSimMotion(read_motion_table(options.motion), options.motion.stem)
    raise BadInputError("give either a movement (--movement) or a motion file (--motion)")


def _motion_name(options: SimulateOptions) -> str:
    if options.motion is not None:
        return options.motion.stem
    return find_movement(options.movement or "").name


def _command(options: SimulateOptions) -> str:
    """Return the command that makes this recording again, without folders, so that it does not depend on where it ran."""
    words = ["ghest-rt", "simulate"]
    if options.motion is not None:
        words += ["--motion", options.motion.name]
    else:
        words += ["--movement", _motion_name(options)]
    words += ["--sensor", options.sensor, "--seed", str(options.seed)]
    if options.duration_s is not None:
        words += ["--duration", f"{options.duration_s:g}"]
    if options.arm != "right":
        words += ["--arm", options.arm]
    if options.height_m != 1.75:
        words += ["--height", f"{options.height_m:g}"]
    if options.marker != "disks":
        words += ["--marker", options.marker]
    return shlex.join([*words, "--out", options.out.name])
