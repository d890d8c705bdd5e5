"""The simulated clinic, or the knee, set up as options describe it."""

import math
from pathlib import Path

from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.shipped import shipped_config_dir
from ghest_rt.errors import BadInputError
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.calibrating import with_reference
from ghest_rt.simulation.calibration_motion import NAME as CALIBRATION
from ghest_rt.simulation.calibration_motion import CalibrationMotion
from ghest_rt.simulation.fitting import fit_station, without_depth
from ghest_rt.simulation.imaging import Light
from ghest_rt.simulation.knee import DURATION_S, JOINT, KneeMotion, KneeStage
from ghest_rt.simulation.opensim_file import read_motion_table
from ghest_rt.simulation.opensim_motion import OpenSimMotion
from ghest_rt.simulation.options import HEIGHT_M, SimulateOptions
from ghest_rt.simulation.posture import Motion
from ghest_rt.simulation.sensors import find_sensors
from ghest_rt.simulation.soft_tissue import find_soft_tissue
from ghest_rt.simulation.staged import StagedWorld
from ghest_rt.simulation.therapy import TherapyMotion, find_movement
from ghest_rt.simulation.timeline import Timeline
from ghest_rt.simulation.world import World

_STATIONS = {
    ("paper", "right"): "station-sim.toml",
    ("paper", "left"): "station-sim-left.toml",
    ("sr300", "right"): "station-sr300-sim.toml",
    ("sr300", "left"): "station-sr300-sim-left.toml",
}


_GREATEST_SEED = (1 << 63) - 1


def stage_world(options: SimulateOptions) -> StagedWorld:
    """Set up what `options` describe (`out` and `faults` are not used): the clinic, or the knee if the station measures one.

    Raises:
        BadInputError: An option, the station file or the motion file cannot be used.
        GhestError: The exoskeleton cannot follow the movement.
    """
    if options.station is not None:
        station = load_station(options.station)
        if station.config.joint.name == JOINT:
            _check_numbers(options)
            return _knee_world(options, station)
    return build_world(options)


def build_world(options: SimulateOptions) -> World:
    """Set up the simulated clinic that `options` describe (`out` and `faults` are not used).

    Raises:
        BadInputError: An option, the station file or the motion file cannot be used.
        GhestError: The exoskeleton cannot follow the movement.
    """
    _check_numbers(options)
    sensors = find_sensors(options.sensor)
    body = anatomy(options.height_m)
    station = fit_station(_station(options), body)
    if options.color_only:
        station = without_depth(station)
    if station.config.station.arm != options.arm:
        raise BadInputError(
            f"{station.source}: station.arm is {station.config.station.arm}, asked for is the {options.arm} arm; "
            f"use --arm {station.config.station.arm} or another station file"
        )
    motion = motion_of(options.movement, options.motion, options.seed)
    if options.calibration_reference:
        station = with_reference(station, body, options.seed, motion.name)
    return World(
        station,
        body,
        motion,
        sensors,
        seed=options.seed,
        texture=options.marker,
        light=Light(options.brightness, options.white_balance),
        duration_s=options.duration_s,
        marker_moves=options.marker_moves,
        soft_tissue=find_soft_tissue(options.soft_tissue),
        imaging=options.imaging,
    )


def _check_numbers(options: SimulateOptions) -> None:
    if not 0 <= options.seed <= _GREATEST_SEED:
        raise BadInputError(f"--seed {options.seed}: give a whole number from 0 to {_GREATEST_SEED}")
    if options.duration_s is not None and not 0.0 < options.duration_s < math.inf:
        raise BadInputError(f"--duration {options.duration_s:g}: give a positive number of seconds")
    if min(options.brightness, *options.white_balance) <= 0:
        raise BadInputError("brightness and white balance are factors: give positive numbers")


def _knee_world(options: SimulateOptions, station: LoadedStation) -> StagedWorld:
    """Set up the example of another limb, config/examples/knee."""
    given = {
        f"--movement {options.movement}": options.movement is not None,
        f"--motion {options.motion}": options.motion is not None,
        f"--arm {options.arm}": options.arm != "right",
        f"--height {options.height_m:g}": options.height_m != HEIGHT_M,
        "--marker-shift or --marker-turn": bool(options.marker_moves),
        f"--soft-tissue {options.soft_tissue}": options.soft_tissue != "none",
        "--calibration-reference": options.calibration_reference,
    }
    without_effect = [option for option, there in given.items() if there]
    if without_effect:
        raise BadInputError(
            f"{', '.join(without_effect)}: no use with {station.source}: the simulated knee is one person's right one, has one "
            "movement, no marker shifts and no soft tissue; leave this out"
        )
    if options.color_only:
        station = without_depth(station)
    return StagedWorld(
        station,
        KneeStage(station, KneeMotion.from_seed(options.seed)),
        find_sensors(options.sensor),
        Timeline(DURATION_S if options.duration_s is None else min(options.duration_s, DURATION_S)),
        motion_name=JOINT,
        seed=options.seed,
        texture=options.marker,
        light=Light(options.brightness, options.white_balance),
        imaging=options.imaging,
    )


def _station(options: SimulateOptions) -> LoadedStation:
    if options.station is not None:
        return load_station(options.station)
    return load_station(shipped_config_dir() / _STATIONS[options.sensor, options.arm])


def motion_of(movement: str | None, file: Path | None, seed: int) -> Motion:
    """Return a movement of Table 2, that of a calibration session (CAL), or that of an OpenSim motion file.

    Args:
        movement: Its name, or None with `file`.
        file: The file, or None with `movement`.
        seed: Of a movement of Table 2.

    Raises:
        BadInputError: Both are given or none, the movement is unknown, or the file cannot be used.
    """
    if movement is not None and file is None:
        if movement.upper() == CALIBRATION:
            return CalibrationMotion(seed)
        return TherapyMotion(find_movement(movement), seed)
    if file is not None and movement is None:
        return OpenSimMotion(read_motion_table(file), file.stem)
    raise BadInputError("give either a movement (--movement) or a motion file (--motion)")
