"""Simulated clinics, set up once and shared: nothing in them changes."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from ghest_rt.simulation.building import build_world
from ghest_rt.simulation.options import SimulateOptions
from ghest_rt.simulation.world import World


@pytest.fixture(scope="session")
def make_world() -> Callable[..., World]:
    """Return a maker of worlds: sensor, arm and other options by name."""

    @cache
    def make(**options: object) -> World:
        defaults = {"out": Path("unused.mcap"), "movement": "COMB", "seed": 4, "duration_s": 2.0}
        return build_world(SimulateOptions(**{**defaults, **options}))  # type: ignore[arg-type]

    return make
