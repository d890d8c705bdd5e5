"""CANopen encoders, CiA 406: position value 6004h in a transmit PDO, one node per joint."""

import asyncio
import functools
from collections import deque
from dataclasses import dataclass
from typing import Any

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceLost, DeviceNotFound
from ghest_drivers.hardware.encoders.assembly import FrameAssembler
from ghest_drivers.hardware.encoders.builder import Counting
from ghest_drivers.hardware.encoders.can_bus import CanBusSettings, CanFrame, CanReceiver, open_bus
from ghest_drivers.hardware.encoders.canopen_objects import (
    EVENT_DRIVEN,
    POSITION_VALUE,
    TPDO_COB_IDS,
    add_mapped_objects,
    object_dictionary,
)
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.handoff import Handoff
from ghest_drivers.hardware.encoders.link import SampleQueueLink
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.installing import pip_install

_PRE_OPERATIONAL_COMMAND = 0x80
_START_COMMAND = 0x01
_BOOT_UP = 0
_OPERATIONAL = 5


@dataclass(frozen=True, slots=True)
class CanopenSettings:
    """A CANopen encoder link. `Channel.source` is the node id.

    Attributes:
        bus: The bus.
        channels: The encoders, in the order of the angles delivered; at most one per node.
        tpdo: Number of the transmit PDO (1 to 4) that carries the position value.
        setup: "read" the PDO's mapping from the node, "configure" it by SDO, or "assume" that the position value is its first
            and only content under the predefined frame id.
        sync_period_ms: Send SYNC so often, and have the nodes answer each; None if the nodes send on their own.
        event_timer_ms: With setup "configure" and no SYNC: the nodes send so often.
        window_ns: Longest time from the first node's frame of a sample to the last's.
        latency_ns: Least delay between latch and the bus time stamp.
        silent_s: Longest time without an acceptable sample before the link counts as lost.
    """

    bus: CanBusSettings
    channels: tuple[Channel, ...]
    tpdo: int = 1
    setup: str = "read"
    sync_period_ms: int | None = None
    event_timer_ms: int = 10
    window_ns: int = 5_000_000
    latency_ns: int = 0
    silent_s: float = 1.0

    def __post_init__(self) -> None:
        if self.setup not in {"read", "configure", "assume"}:
            raise ValueError("setup: must be read, configure or assume")
        if self.tpdo not in TPDO_COB_IDS:
            raise ValueError("tpdo: must be from 1 to 4")
        if len(set(self.node_ids)) != len(self.channels) or not all(1 <= node <= 127 for node in self.node_ids):
            raise ValueError("source: must be a different node id from 1 to 127 for each channel")

    @property
    def node_ids(self) -> tuple[int, ...]:
        """The nodes, in the order of the channels."""
        return tuple(int(channel.source, 0) for channel in self.channels)


class CanopenEncoderLink(SampleQueueLink):
    """`EncoderLink` over the canopen package. A node that restarts is started again."""

    def __init__(self, settings: CanopenSettings, clock: Clock) -> None:
        counting = Counting(tick_ns=1, latency_ns=settings.latency_ns)
        super().__init__(settings.bus.name, settings.channels, counting, clock, silent_s=settings.silent_s)
        self._settings = settings
        self._assembler = FrameAssembler(settings.node_ids, settings.window_ns, self.stats)
        self._receiver: CanReceiver | None = None
        self._network: Any = None
        self._positions: Handoff[tuple[int, float, CanFrame]] | None = None
        self._frame = CanFrame(0, b"", 0, 0)

    async def _connect(self) -> None:
        loop = asyncio.get_running_loop()
        self._assembler = FrameAssembler(self._settings.node_ids, self._settings.window_ns, self.stats)
        self._positions = Handoff(loop, self._received, self.stats)
        bus = await asyncio.to_thread(open_bus, self._settings.bus)
        ignored: Handoff[CanFrame] = Handoff(loop, deque.clear, self.stats)
        self._receiver = CanReceiver(
            self._name, bus, self._clock, self.stats, handoff=ignored, fail=self._fail, also=self._notify
        )
        try:
            await asyncio.to_thread(self._start_nodes, bus)
        except BaseException:
            await self._disconnect()
            raise

    async def _disconnect(self) -> None:
        network, self._network = self._network, None
        if network is not None:
            network.sync.stop()
        receiver, self._receiver = self._receiver, None
        if receiver is not None:
            await asyncio.to_thread(receiver.stop)

    def _start_nodes(self, bus: Any) -> None:
        """Set up every node and start it; blocks on SDO transfers while the receiver runs."""
        try:
            import canopen  # noqa: PLC0415 - only where this backend is chosen
            from canopen.sdo.exceptions import SdoError  # noqa: PLC0415 - likewise
        except ImportError as error:
            raise DeviceNotFound(f"CANopen encoders need canopen: {pip_install('can')}") from error
        self._network = canopen.Network(bus)
        nodes = {}
        for node_id in self._settings.node_ids:
            node = canopen.RemoteNode(node_id, object_dictionary(node_id, self._settings.tpdo))
            nodes[node_id] = self._network.add_node(node)
        if self._receiver is not None:
            self._receiver.start()
        for node_id, node in nodes.items():
            try:
                self._set_up(node_id, node)
            except (SdoError, KeyError) as error:
                raise DeviceNotFound(
                    f"{self._name}: node {node_id} does not offer its position value (6004h) in TPDO "
                    f"{self._settings.tpdo}: {error}; check node id, bit rate and power"
                ) from error
        if self._settings.sync_period_ms is not None:
            self._network.sync.start(self._settings.sync_period_ms / 1000)

    def _set_up(self, node_id: int, node: Any) -> None:
        tpdo = node.tpdo[self._settings.tpdo]
        if self._settings.setup == "configure":
            tpdo.read(from_od=True)
            node.nmt.send_command(_PRE_OPERATIONAL_COMMAND)  # mappings may change only there
            tpdo.trans_type = EVENT_DRIVEN if self._settings.sync_period_ms is None else 1
            tpdo.event_timer = self._settings.event_timer_ms if self._settings.sync_period_ms is None else None
            tpdo.save()
        elif self._settings.setup == "read":
            add_mapped_objects(node.object_dictionary, tpdo.map_array)
            tpdo.read()
        else:
            tpdo.read(from_od=True)
        variable = tpdo[POSITION_VALUE]
        tpdo.add_callback(functools.partial(self._position, node_id, variable))
        node.nmt.add_heartbeat_callback(functools.partial(self._heartbeat, node))
        node.nmt.send_command(_START_COMMAND)

    def _notify(self, frame: CanFrame) -> None:
        """Let canopen see a frame; in the receiver's thread."""
        self._frame = frame
        network = self._network
        if network is not None:
            network.notify(frame.frame_id, bytearray(frame.data), frame.t_bus_ns * 1e-9)

    def _position(self, node_id: int, variable: Any, _tpdo: Any) -> None:
        if self._positions is not None:
            self._positions.put((node_id, float(variable.raw), self._frame))

    def _heartbeat(self, node: Any, state: int) -> None:
        """Start a node that has restarted; what was configured is lost then, so the whole link must be opened again."""
        if state == _BOOT_UP and self._settings.setup == "configure" and self._positions is not None:
            lost = DeviceLost(f"{self._name}: node {node.id} has restarted")
            self._positions.call(functools.partial(self._fail, lost))
        elif state != _OPERATIONAL:
            node.nmt.send_command(_START_COMMAND)

    def _received(self, positions: deque[tuple[int, float, CanFrame]]) -> None:
        for node_id, position, frame in positions:
            whole = self._assembler.add(node_id, (position,), None, t_bus_ns=frame.t_bus_ns, t_arrival_ns=frame.t_arrival_ns)
            if whole is not None:
                counts = tuple(whole.values[node][0] for node in self._settings.node_ids)
                self._deliver((RawReading(counts, ticks=whole.t_bus_ns),), frame.t_arrival_ns, whole.t_first_ns)
