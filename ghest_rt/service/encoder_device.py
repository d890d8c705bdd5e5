"""From the station file to an encoder link: units, limits of the URDF, paths."""

import math
from pathlib import Path

from ghest_drivers import factory
from ghest_drivers.clock import Clock
from ghest_drivers.errors import BadDeviceData
from ghest_drivers.hardware.encoders.armeo_export import ArmeoSettings
from ghest_drivers.hardware.encoders.binary_frame import DOCUMENTED_RAD_PER_COUNT, BinaryFormat, documented_format
from ghest_drivers.hardware.encoders.can_bus import CanBusSettings
from ghest_drivers.hardware.encoders.can_layout import CanLayout
from ghest_drivers.hardware.encoders.can_link import CanSettings
from ghest_drivers.hardware.encoders.can_log import CanLogSettings
from ghest_drivers.hardware.encoders.canopen_link import CanopenSettings
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.serial_link import SerialSettings
from ghest_drivers.hardware.encoders.text_line import TextFormat
from ghest_drivers.interfaces import EncoderLink
from ghest_rt.config.encoder_devices import (
    ArmeoBackend,
    CanBackend,
    CanBus,
    CanLogBackend,
    CanopenBackend,
    DbcLayout,
    EncoderChannel,
    HardwareEncoderBackend,
    HardwareEncoders,
    SerialBackend,
    TextLayout,
)
from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError
from ghest_rt.kinematics.urdf import Urdf, parse_urdf

_NS_PER_MS = 1_000_000
_DEFAULT_CHANNEL = EncoderChannel()

Settings = SerialSettings | CanSettings | CanLogSettings | CanopenSettings | ArmeoSettings


def make_encoder_link(station: LoadedStation, clock: Clock, *, paced: bool = True) -> EncoderLink:
    """Return the encoder link of a station file, not yet open; for the hardware backends.

    Args:
        station: The station.
        clock: Host monotonic clock.
        paced: Whether files are replayed at their pace.

    Raises:
        BadInputError: A setting does not fit the others, or a file it names cannot be read.
        DeviceNotFound: The backend's library is not installed.
    """
    device = station.config.encoders.device
    if not isinstance(device, HardwareEncoderBackend):
        raise BadInputError(f"{station.source}: encoders.device: the backend {device.backend} is no hardware; correct it")
    try:
        settings = encoder_settings(station, device, paced=paced)
        return factory.make_encoders(device.backend, clock, {"settings": settings})
    except (ValueError, BadDeviceData) as error:
        raise BadInputError(f"{station.source}: encoders.device: {error}; correct it") from error


def encoder_settings(station: LoadedStation, device: HardwareEncoderBackend, *, paced: bool = True) -> Settings:
    """Return the driver's settings.

    Raises:
        BadInputError: The URDF is not valid, or a file named cannot be read.
        ValueError: A setting does not fit the others.
    """
    folder = Path(station.source).parent
    joints = station.config.encoders.joints
    urdf = parse_urdf(station.urdf_text, station.config.exoskeleton.urdf)
    channels = _channels(device, joints, urdf)
    latency_ns, silent_s = round(device.latency_ms * _NS_PER_MS), device.silent_ms / 1000
    match device:
        case SerialBackend():
            return SerialSettings(
                device.port,
                _serial_layout(device, len(joints)),
                channels,
                baud=device.baud,
                time_tick_ns=device.time_tick_ns,
                latency_ns=latency_ns,
                fault_mask=device.fault_mask,
                silent_s=silent_s,
            )
        case CanBackend():
            layout = _can_layout(device, folder)
            return CanSettings(_bus(device.bus), layout, channels, latency_ns, device.fault_mask, silent_s)
        case CanLogBackend():
            layout = _can_layout(device, folder)
            return CanLogSettings(folder / device.path, layout, channels, device.fault_mask, paced)
        case CanopenBackend():
            return CanopenSettings(
                _bus(device.bus),
                channels,
                tpdo=device.tpdo,
                setup=device.setup,
                sync_period_ms=device.sync_period_ms,
                event_timer_ms=device.event_timer_ms,
                window_ns=round(device.window_ms * _NS_PER_MS),
                latency_ns=latency_ns,
                silent_s=silent_s,
            )
        case ArmeoBackend():
            return ArmeoSettings(folder / device.path, channels, device.time_column, device.delimiter, paced)


def _channels(device: HardwareEncoders, joints: tuple[str, ...], urdf: Urdf) -> tuple[Channel, ...]:
    unknown = sorted(set(device.channels) - set(joints))
    if unknown:
        raise ValueError(f"channels: {', '.join(unknown)} is not in encoders.joints")
    return tuple(
        _channel(device, joint, index, device.channels.get(joint, _DEFAULT_CHANNEL), urdf) for index, joint in enumerate(joints)
    )


def _channel(device: HardwareEncoders, joint: str, index: int, config: EncoderChannel, urdf: Urdf) -> Channel:
    if joint not in urdf.joints:
        raise ValueError(f"encoders.joints: {joint} is not a joint of {urdf.source}")
    limits = urdf.joints[joint]
    margin_rad = math.radians(device.margin_deg)
    low_rad, high_rad = limits.lower - margin_rad, limits.upper + margin_rad
    if config.range_deg is not None:
        low_rad, high_rad = math.radians(config.range_deg[0]), math.radians(config.range_deg[1])
    max_rate = limits.max_rate if config.max_rate_deg_s is None else math.radians(config.max_rate_deg_s)
    return Channel(
        joint,
        _source(device, config, joint, index),
        _rad_per_count(device, config, joint),
        config.zero_counts,
        config.sign,
        math.radians(config.offset_deg),
        config.wrap,
        low_rad,
        high_rad,
        max_rate,
    )


def _source(device: HardwareEncoders, config: EncoderChannel, joint: str, index: int) -> str:
    if config.source is not None:
        return config.source
    if isinstance(device, SerialBackend):
        return f"a{index}"
    raise ValueError(f"channels.{joint}.source: must be given")


def _rad_per_count(device: HardwareEncoders, config: EncoderChannel, joint: str) -> float:
    if config.deg_per_count is not None:
        return math.radians(config.deg_per_count)
    if config.counts_per_turn is not None:
        return math.tau / config.counts_per_turn
    if isinstance(device, SerialBackend) and device.layout is None:
        return DOCUMENTED_RAD_PER_COUNT
    raise ValueError(f"channels.{joint}: deg_per_count or counts_per_turn must be given")


def _serial_layout(device: SerialBackend, joints: int) -> BinaryFormat | TextFormat:
    layout = device.layout
    if layout is None:
        return documented_format(joints)
    if isinstance(layout, TextLayout):
        return TextFormat(
            layout.fields,
            layout.delimiter,
            layout.prefix,
            layout.decimal_comma,
            layout.checksum,
            layout.seq_modulus,
            layout.time_decimals,
            layout.time_modulus,
        )
    fields = tuple((name, kind) for name, _, kind in (field.partition(":") for field in layout.fields))
    return BinaryFormat(
        bytes.fromhex(layout.sync_hex),
        fields,
        layout.byte_order == "big",
        layout.length_counts,
        layout.checksum,
        layout.checksum_covers_sync,
    )


def _bus(bus: CanBus) -> CanBusSettings:
    return CanBusSettings(bus.interface, bus.channel, bus.bitrate, dict(bus.options))


def _can_layout(device: DbcLayout, folder: Path) -> CanLayout:
    path = folder / device.dbc
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise BadInputError(
            f"{path}: cannot read the DBC file: {error.strerror or error}; correct encoders.device.dbc"
        ) from error
    return CanLayout(
        text,
        device.time_signal,
        device.time_tick_ns,
        device.status_signal,
        device.counter_signal,
        device.checksum_signal,
        round(device.window_ms * _NS_PER_MS),
    )
