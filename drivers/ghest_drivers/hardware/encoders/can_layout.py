"""CAN frames to raw readings, with the layout from a DBC file. Pure: frames in, readings out."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ghest_drivers.errors import BadDeviceData, DeviceNotFound
from ghest_drivers.hardware.encoders.assembly import FrameAssembler
from ghest_drivers.hardware.encoders.builder import Counting
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.checksums import crc8_j1850
from ghest_drivers.hardware.encoders.reading import RawReading
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection
from ghest_drivers.installing import pip_install


@dataclass(frozen=True, slots=True)
class CanLayout:
    """Where angles, time, counter and status are in the messages of a DBC file.

    A signal is named "Message.Signal", or "Message.Signal@0x29" to use the layout of a message under another frame id
    (several equal drives). Channels name theirs in `Channel.source`; its unit is the DBC's physical one.

    Attributes:
        dbc_text: The DBC file.
        time_signal: Device time, counted raw; None: the bus time stamp of the first frame is used.
        time_tick_ns: One raw count of the time signal.
        status_signal: Status bits; None if there are none.
        counter_signal: Name of the signal, in every message used, that is equal in all frames of one sample; None for none.
        checksum_signal: Name of the signal, in every message used, with the CRC-8/SAE-J1850 of frame id (two bytes, low first)
            and data without it; must fill the last byte. None for none.
        window_ns: Longest time from the first frame of a sample to its last.
    """

    dbc_text: str
    time_signal: str | None = None
    time_tick_ns: int = 1000
    status_signal: str | None = None
    counter_signal: str | None = None
    checksum_signal: str | None = None
    window_ns: int = 5_000_000


@dataclass(slots=True)
class _Part:
    """One message of the layout.

    Attributes:
        message: Its cantools definition.
        places: (index of the channel, signal name, raw value to physical value) of the angles it carries.
        extras: Names of the signals wanted raw besides: time and status.
    """

    message: Any
    places: list[tuple[int, str, Callable[[float], float]]] = field(default_factory=list)
    extras: list[str] = field(default_factory=list)


class CanDecoder:
    """Decodes frames and assembles them to readings.

    Raises:
        DeviceNotFound: cantools is not installed.
        BadDeviceData: The DBC text is not valid, or lacks a message or signal that the layout names.
    """

    def __init__(self, layout: CanLayout, channels: tuple[Channel, ...], stats: LinkStats) -> None:
        self._layout = layout
        self._stats = stats
        self._channels = len(channels)
        self._database = _load(layout.dbc_text)
        self._parts: dict[int, _Part] = {}
        for index, channel in enumerate(channels):
            key, signal = self._place(channel.source)
            to_physical = functools.partial(signal.conversion.raw_to_scaled, decode_choices=False)
            self._parts[key].places.append((index, signal.name, to_physical))
        self._time: tuple[int, str, int] | None = None
        if layout.time_signal is not None:
            key, signal = self._place(layout.time_signal)
            self._time = (key, signal.name, signal.length)
            self._parts[key].extras.append(signal.name)
        self._status: tuple[int, str] | None = None
        if layout.status_signal is not None:
            key, signal = self._place(layout.status_signal)
            self._status = (key, signal.name)
            self._parts[key].extras.append(signal.name)
        self._counter_bits = self._common_bits(layout.counter_signal)
        self._checksummed = self._common_bits(layout.checksum_signal) is not None
        self._assembler = FrameAssembler(list(self._parts), layout.window_ns, stats)

    @property
    def frame_ids(self) -> tuple[int, ...]:
        """The frames that a sample is made of."""
        return tuple(self._parts)

    def counting(self, latency_ns: int, fault_mask: int) -> Counting:
        """Return how samples and time are counted: by the time signal if there is one, else by the bus."""
        modulus = None if self._counter_bits is None else 1 << self._counter_bits
        if self._time is not None:
            return Counting(modulus, self._layout.time_tick_ns, 1 << self._time[2], latency_ns, fault_mask)
        return Counting(modulus, 1, None, latency_ns, fault_mask)

    def feed(self, frame_id: int, data: bytes, t_bus_ns: int, t_arrival_ns: int) -> tuple[RawReading, int] | None:
        """Take in one frame; return the reading it completes and the arrival of its first frame."""
        part = self._parts.get(frame_id)
        if part is None:
            return None
        if len(data) != part.message.length:
            self._stats.rejected[Rejection.BAD_FRAME] += 1
            return None
        if self._checksummed and crc8_j1850((frame_id & 0xFFFF).to_bytes(2, "little") + data[:-1]) != data[-1]:
            self._stats.rejected[Rejection.BAD_CHECKSUM] += 1
            return None
        decoded = self._decode(part, data)
        if decoded is None:
            return None
        values, counter = decoded
        whole = self._assembler.add(frame_id, values, counter, t_bus_ns=t_bus_ns, t_arrival_ns=t_arrival_ns)
        if whole is None:
            return None
        counts = [0.0] * self._channels
        ticks, status = whole.t_bus_ns, 0
        for key, part_values in whole.values.items():
            places = self._parts[key].places
            for (index, _, _), value in zip(places, part_values, strict=False):
                counts[index] = value
            extra = len(places)
            if self._time is not None and self._time[0] == key:
                ticks = int(part_values[extra])
                extra += 1
            if self._status is not None and self._status[0] == key:
                status = int(part_values[extra])
        return RawReading(tuple(counts), whole.counter, ticks, status), whole.t_first_ns

    def _decode(self, part: _Part, data: bytes) -> tuple[tuple[float, ...], int | None] | None:
        """Return the part's angles, then its raw time and status if it has them, and its counter."""
        try:
            raw: Mapping[str, float] = part.message.decode_simple(data, decode_choices=False, scaling=False)
        except Exception:  # cantools raises several unrelated types for data that does not fit
            self._stats.rejected[Rejection.BAD_FRAME] += 1
            return None
        values = [to_physical(raw[name]) for _, name, to_physical in part.places]
        values += [raw[name] for name in part.extras]
        counter = self._layout.counter_signal
        return tuple(values), None if counter is None else int(raw[counter])

    def _place(self, source: str) -> tuple[int, Any]:
        """Return the frame id and the cantools signal named by `source`, and see to it that the frame is listened for."""
        name, _, number = source.partition("@")
        message_name, _, signal_name = name.partition(".")
        try:
            message = self._database.get_message_by_name(message_name)
            signal = message.get_signal_by_name(signal_name)
            key = int(number, 0) if number else message.frame_id
        except (KeyError, ValueError) as error:
            raise BadDeviceData(
                f"CAN signal {source!r}: not in the DBC file; it must read Message.Signal or Message.Signal@0x29"
            ) from error
        if message.is_multiplexed():
            raise BadDeviceData(f"CAN signal {source!r}: multiplexed messages are not supported")
        if self._parts.setdefault(key, _Part(message)).message is not message:
            raise BadDeviceData(f"CAN signal {source!r}: frame id {key:#x} is taken by another message")
        return key, signal

    def _common_bits(self, name: str | None) -> int | None:
        """Return the length of the signal `name` that every part must have."""
        if name is None:
            return None
        bits = None
        for part in self._parts.values():
            try:
                bits = int(part.message.get_signal_by_name(name).length)
            except KeyError as error:
                raise BadDeviceData(f"CAN message {part.message.name}: lacks the signal {name}") from error
        return bits


def _load(dbc_text: str) -> Any:
    try:
        import cantools  # noqa: PLC0415 - only where this backend is chosen
    except ImportError as error:
        raise DeviceNotFound(f"CAN encoders need cantools: {pip_install('can')}") from error
    try:
        return cantools.database.load_string(dbc_text, "dbc")
    except Exception as error:  # cantools and its parser raise several unrelated types
        raise BadDeviceData(f"the DBC file is not valid: {error}") from error
