"""Encoders on a CAN bus, layout from a DBC file."""

import asyncio
from collections import deque
from dataclasses import dataclass

from ghest_drivers.clock import Clock
from ghest_drivers.hardware.encoders.can_bus import CanBusSettings, CanFrame, CanReceiver, open_bus
from ghest_drivers.hardware.encoders.can_layout import CanDecoder, CanLayout
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.handoff import Handoff
from ghest_drivers.hardware.encoders.link import SampleQueueLink
from ghest_drivers.hardware.encoders.stats import LinkStats


@dataclass(frozen=True, slots=True)
class CanSettings:
    """A CAN encoder link.

    Attributes:
        bus: The bus.
        layout: What is sent.
        channels: The encoders, in the order of the angles delivered.
        latency_ns: Least delay between latch and arrival (or the bus time stamp, where it is the time used).
        fault_mask: Bits of the status signal that mean that the angles are not to be trusted.
        silent_s: Longest time without an acceptable sample before the link counts as lost.
    """

    bus: CanBusSettings
    layout: CanLayout
    channels: tuple[Channel, ...]
    latency_ns: int = 0
    fault_mask: int = -1
    silent_s: float = 1.0


class CanEncoderLink(SampleQueueLink):
    """`EncoderLink` over python-can.

    Raises:
        DeviceNotFound: cantools is not installed.
        BadDeviceData: The DBC file is not valid or lacks a signal.
    """

    def __init__(self, settings: CanSettings, clock: Clock) -> None:
        layout = CanDecoder(settings.layout, settings.channels, LinkStats())
        counting = layout.counting(settings.latency_ns, settings.fault_mask)
        super().__init__(settings.bus.name, settings.channels, counting, clock, silent_s=settings.silent_s)
        self._settings = settings
        self._decoder = layout
        self._receiver: CanReceiver | None = None

    async def _connect(self) -> None:
        self._decoder = CanDecoder(self._settings.layout, self._channels, self.stats)
        bus = await asyncio.to_thread(open_bus, self._settings.bus)
        if self._settings.bus.interface == "socketcan":
            # Filtered in the kernel, which lets error frames pass; python-can's own filters would drop them.
            ids = self._decoder.frame_ids
            bus.set_filters([{"can_id": key, "can_mask": 0x1FFFFFFF, "extended": key > 0x7FF} for key in ids])
        handoff = Handoff(asyncio.get_running_loop(), self._received, self.stats)
        self._receiver = CanReceiver(self._name, bus, self._clock, self.stats, handoff=handoff, fail=self._fail)
        self._receiver.start()

    async def _disconnect(self) -> None:
        receiver, self._receiver = self._receiver, None
        if receiver is not None:
            await asyncio.to_thread(receiver.stop)

    def _received(self, frames: deque[CanFrame]) -> None:
        for frame in frames:
            whole = self._decoder.feed(frame.frame_id, frame.data, frame.t_bus_ns, frame.t_arrival_ns)
            if whole is not None:
                reading, t_first_ns = whole
                self._deliver((reading,), frame.t_arrival_ns, t_first_ns)
