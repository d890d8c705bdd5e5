"""CANopen encoders (CiA 406) played by canopen's own local nodes on the virtual bus."""

from collections.abc import Iterator

import numpy as np
import pytest

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import DeviceLost, DeviceNotFound
from ghest_drivers.hardware.encoders.can_bus import CanBusSettings
from ghest_drivers.hardware.encoders.canopen_link import CanopenEncoderLink, CanopenSettings
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.interfaces import EncoderLink
from tests.hardware_encoders.canopen_senders import NODES, Encoders

COUNT = 2 * np.pi / 4096


@pytest.fixture
def encoders(request: pytest.FixtureRequest) -> Iterator[Encoders]:
    far_side = Encoders(request.node.name, with_speed_first=getattr(request, "param", False))
    yield far_side
    far_side.close()


def link_to(name: str, **more: object) -> CanopenEncoderLink:
    channels = tuple(Channel(f"j{node}", str(node), rad_per_count=COUNT) for node in NODES)
    bus = CanBusSettings("virtual", name)
    return CanopenEncoderLink(CanopenSettings(bus, channels, **more), MonotonicClock())  # type: ignore[arg-type]


async def check(link: CanopenEncoderLink) -> None:
    """Positions of both nodes belong together and grow by the sample."""
    last = 0
    for _ in range(10):
        sample = await link.read(2.0)
        first, second = np.round(sample.angles_rad / COUNT).astype(int)
        assert second - first == 1000
        assert first > last
        assert sample.t_capture_ns <= sample.t_arrival_ns
        last = first


@pytest.mark.parametrize("setup", ["read", "configure", "assume"])
async def test_positions_arrive(encoders: Encoders, setup: str, request: pytest.FixtureRequest) -> None:
    link = link_to(request.node.name, setup=setup)
    await link.open()
    assert isinstance(link, EncoderLink)
    await check(link)
    await link.close()


@pytest.mark.parametrize("encoders", [True], indirect=True)
async def test_another_object_before_the_position_is_passed_over(encoders: Encoders, request: pytest.FixtureRequest) -> None:
    link = link_to(request.node.name)
    await link.open()
    await check(link)
    await link.close()


async def test_with_sync(encoders: Encoders, request: pytest.FixtureRequest) -> None:
    link = link_to(request.node.name, setup="configure", sync_period_ms=10)
    await link.open()
    assert [node.sdo[0x1800][2].raw for node in encoders.nodes.values()] == [1, 1]
    await check(link)
    await link.close()


async def test_a_node_that_restarts_is_started_again(encoders: Encoders, request: pytest.FixtureRequest) -> None:
    link = link_to(request.node.name)
    await link.open()
    await link.read(1.0)
    encoders.nodes[5].nmt.state = "PRE-OPERATIONAL"
    encoders.network.send_message(0x705, b"\x00")
    await check(link)
    assert encoders.nodes[5].nmt.state == "OPERATIONAL"
    await link.close()


async def test_a_configured_node_that_restarts_is_a_loss(encoders: Encoders, request: pytest.FixtureRequest) -> None:
    link = link_to(request.node.name, setup="configure")
    await link.open()
    await link.read(1.0)
    encoders.network.send_message(0x705, b"\x00")
    with pytest.raises(DeviceLost, match="node 5 has restarted"):
        while True:
            await link.read(1.0)
    await link.close()


async def test_one_silent_node_is_a_loss(encoders: Encoders, request: pytest.FixtureRequest) -> None:
    link = link_to(request.node.name, silent_s=0.2)
    await link.open()
    await link.read(1.0)
    encoders.silent.add(6)
    with pytest.raises(DeviceLost, match="no valid encoder sample"):
        while True:
            await link.read(1.0)
    await link.close()


async def test_a_missing_node_is_named() -> None:
    link = link_to("nobody there")
    with pytest.raises(DeviceNotFound, match="node 5 does not offer its position value"):
        await link.open()


@pytest.mark.parametrize(
    ("more", "message"),
    [({"setup": "guess"}, "setup"), ({"tpdo": 5}, "tpdo"), ({"channels": (Channel("j", "200"),)}, "node id")],
)
def test_senseless_settings_are_refused(more: dict[str, object], message: str) -> None:
    settings = {"bus": CanBusSettings("virtual", "x"), "channels": (Channel("j", "5"),), **more}
    with pytest.raises(ValueError, match=message):
        CanopenSettings(**settings)  # type: ignore[arg-type]
