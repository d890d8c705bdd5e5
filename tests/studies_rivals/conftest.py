"""A calibrated rival and sessions without cameras: everything here is quick."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from ghest_rt.geometry.so3 import rot_x, rot_y, rot_z
from ghest_rt.simulation.anatomy import anatomy
from ghest_rt.simulation.building import build_world
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.simulation.posture import Motion, Posture
from ghest_rt.simulation.sensors import find_sensors
from ghest_rt.simulation.world import World
from ghest_rt.studies.rivals.neutral import NeutralCalibration, calibrate

BODY = anatomy(1.75)


@pytest.fixture(scope="session")
def comb() -> World:
    return build_world(SimulateOptions(out=Path(), movement="COMB", seed=1, duration_s=2.0))


@pytest.fixture(scope="session")
def calibration(comb: World) -> NeutralCalibration:
    return calibrate(comb.station, BODY, find_sensors("paper"), seed=1)


@dataclass(frozen=True)
class ArmOnly:
    """The arm moves, the girdle rests."""

    duration_s: float = 1.0
    name: str = "arm only"

    def at(self, t_s: float) -> Posture:
        a, b, g = 0.3 * np.sin(2 * t_s), -0.5 * np.sin(1.5 * t_s), 0.3 * np.sin(t_s + 0.5) - 0.144
        return Posture(
            thorax=np.eye(3),
            thorax_shift_m=np.zeros(3),
            clavicle_rad=(0.0, 0.0),
            scapula=np.eye(3),
            gh=rot_y(a) @ rot_x(b) @ rot_z(g),
            elbow_rad=(np.pi / 2 - 0.2 * np.sin(t_s), 0.0),
            wrist_rad=(0.0, 0.0),
        )


@pytest.fixture(scope="session")
def world_of(comb: World) -> Callable[[Motion], World]:
    def make(motion: Motion) -> World:
        return World(comb.station, BODY, motion, find_sensors("paper"), seed=1)

    return make
