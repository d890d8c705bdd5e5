"""A simulated station that the machine renders too slowly says so, and what to do."""

import logging
from types import SimpleNamespace
from typing import Any

import pytest

from ghest_drivers.clock import VirtualClock
from ghest_rt.cli.sim_pace import PacedWorld


def paced(clock: VirtualClock, render_ms: float) -> PacedWorld:
    def frame(name: str, k: int) -> Any:
        slow_start_ms = 500.0 if k == 0 else render_ms
        clock.sleep_until_ns(clock.now_ns() + round(slow_start_ms * 1e6))
        return SimpleNamespace(info=SimpleNamespace(rate_hz=60.0))

    return PacedWorld(SimpleNamespace(frame=frame), clock.now_ns)  # type: ignore[arg-type]


def test_slow_rendering_is_told_once_with_the_remedy(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.WARNING)
    world = paced(VirtualClock(), 50.0)
    for k in range(100):
        world.frame("r0", k)
        world.frame("r1", k)
    (message,) = caplog.messages
    assert "slower than real time" in message
    assert "takes 50 ms" in message and "every 17 ms" in message
    assert "ghest-rt simulate" in message and "--replay" in message
    assert world.slowness == message


def test_rendering_that_keeps_up_is_not_mentioned(caplog: pytest.LogCaptureFixture) -> None:
    world = paced(VirtualClock(), 5.0)
    for k in range(100):
        world.frame("r0", k)
    assert caplog.messages == []
    assert world.slowness == ""
