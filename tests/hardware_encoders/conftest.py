"""Encoders described for the tests, and lines to feed them through."""

import os
import pty
import tty
from collections.abc import Iterator
from dataclasses import dataclass

import pytest

from ghest_drivers.hardware.encoders.binary_frame import DOCUMENTED_RAD_PER_COUNT, documented_format
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.serial_link import SerialSettings


@dataclass
class PtyPair:
    """A pseudo-terminal: `port` is what the link opens, `master` the far side's descriptor."""

    master: int
    slave: int
    port: str
    hung_up: bool = False

    def send(self, data: bytes) -> None:
        os.write(self.master, data)

    def hang_up(self) -> None:
        if not self.hung_up:
            self.hung_up = True
            os.close(self.slave)
            os.close(self.master)


@pytest.fixture
def pty_pair() -> Iterator[PtyPair]:
    master, slave = pty.openpty()
    tty.setraw(slave)
    pair = PtyPair(master, slave, os.ttyname(slave))
    yield pair
    pair.hang_up()


@pytest.fixture
def channels() -> tuple[Channel, ...]:
    """Three joints as in the documented frame, one with reversed sign and its zero elsewhere."""
    scale = DOCUMENTED_RAD_PER_COUNT
    return (
        Channel("j0", "a0", rad_per_count=scale, min_rad=-2.0, max_rad=2.0, max_rate_rad_s=10.0),
        Channel("j1", "a1", rad_per_count=scale, sign=-1, zero_counts=100_000.0, min_rad=-2.0, max_rad=2.0),
        Channel("j2", "a2", rad_per_count=scale),
    )


@pytest.fixture
def serial_settings(pty_pair: PtyPair, channels: tuple[Channel, ...]) -> SerialSettings:
    return SerialSettings(pty_pair.port, documented_format(3), channels, silent_s=5.0)
