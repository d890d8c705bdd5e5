"""Encoder links in the station file. docs/encoder-links.md has an example of each."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from ghest_rt.config.strict import BINARY_FIELD_FORM, BYTES_FORM, TEXT_FIELD_FORM, Strict

ChecksumName = Literal["crc32", "crc16_ccitt", "crc16_modbus", "crc8_j1850", "xor8"]


class EncoderChannel(Strict):
    """One encoder: joint angle = sign * (counts - zero_counts) * scale + offset."""

    source: str | None = Field(
        default=None,
        description="Field of the frame or line, Message.Signal, node id, or column title",
    )
    deg_per_count: float | None = Field(default=None, gt=0, description="Scale; or give counts_per_turn")
    counts_per_turn: float | None = Field(default=None, gt=0, description="Scale; or give deg_per_count")
    zero_counts: float = Field(default=0.0, description="Counts at which the encoder itself reads zero")
    sign: Literal[1, -1] = Field(default=1, description="-1 where counts decrease as the joint angle grows")
    offset_deg: float = Field(default=0.0, description="Joint angle where the encoder reads zero")
    wrap: bool = Field(default=False, description="Single-turn encoder: take the angle nearest the middle of the range")
    range_deg: tuple[float, float] | None = Field(default=None, description="Plausible range; the URDF's limits if left out")
    max_rate_deg_s: float | None = Field(default=None, gt=0, description="Plausible speed; the URDF's limit if left out")

    @model_validator(mode="after")
    def _one_scale(self) -> "EncoderChannel":
        if self.deg_per_count is not None and self.counts_per_turn is not None:
            raise ValueError("give deg_per_count or counts_per_turn, not both")
        if self.range_deg is not None and not self.range_deg[0] < self.range_deg[1]:
            raise ValueError("range_deg: the lower limit comes first")
        return self


class HardwareEncoders(Strict):
    """What all encoder links have in common."""

    channels: dict[str, EncoderChannel] = Field(default={}, description="By joint; joints left out take the defaults")
    latency_ms: float = Field(default=0.0, ge=0.0, le=100.0, description="Least delay from latch to arrival, if known")
    silent_ms: int = Field(default=1000, ge=20, le=60_000, description="Lost after so long without an acceptable sample")
    margin_deg: float = Field(default=3.0, ge=0.0, le=45.0, description="Allowed beyond the URDF's limits")
    fault_mask: int = Field(default=0xFF, ge=0, description="Status bits that mean: do not trust the angles")


class BinaryLayout(Strict):
    """A binary frame: sync, fields, checksum. Fields read "name:type"; length, seq, time, status and pad are special names."""

    kind: Literal["binary"]
    sync_hex: str = Field(default="a55a", pattern=BYTES_FORM)
    fields: tuple[Annotated[str, Field(pattern=BINARY_FIELD_FORM)], ...] = Field(min_length=1)
    byte_order: Literal["little", "big"] = "little"
    length_counts: Literal["payload", "frame"] = "payload"
    checksum: ChecksumName = "crc32"
    checksum_covers_sync: bool = True


class TextLayout(Strict):
    """A line of numbers. Fields seq, time, status and skip are special names."""

    kind: Literal["text"]
    fields: tuple[Annotated[str, Field(pattern=TEXT_FIELD_FORM)], ...] = Field(min_length=1)
    delimiter: str = Field(default=";", min_length=1, max_length=1)
    prefix: str = Field(default="", max_length=32)
    decimal_comma: bool = False
    checksum: ChecksumName | None = None
    seq_modulus: int = Field(default=1 << 16, ge=2)
    time_decimals: int = Field(default=0, ge=0, le=9)
    time_modulus: int | None = Field(default=1 << 32, ge=2)


class SerialBackend(HardwareEncoders):
    """An encoder box on a serial line (needs the extra `serial`); without a layout it sends the documented frame."""

    backend: Literal["serial"]
    port: str = Field(description="Device, or URL of pyserial: socket://host:port, rfc2217://host:port")
    baud: int = Field(default=115200, ge=300, le=12_000_000)
    time_tick_ns: int = Field(default=1000, ge=1, description="One tick of the field time")
    layout: Annotated[BinaryLayout | TextLayout, Field(discriminator="kind")] | None = None


class CanBus(Strict):
    """A bus, in python-can's terms."""

    interface: str = Field(description="socketcan, slcan, pcan, kvaser, vector, udp_multicast, virtual, …")
    channel: str
    bitrate: int | None = Field(default=None, ge=1000)
    options: dict[str, str | int | float | bool] = Field(default={}, description="Passed on to the interface as they are")


class DbcLayout(HardwareEncoders):
    """Where angles, time, counter and status are in the messages of a DBC file. Signals read "Message.Signal"."""

    dbc: str = Field(description="DBC file, relative to the station file")
    time_signal: str | None = None
    time_tick_ns: int = Field(default=1000, ge=1, description="One raw count of the time signal")
    status_signal: str | None = None
    counter_signal: str | None = Field(default=None, description="Signal name, in every message used")
    checksum_signal: str | None = Field(default=None, description="Signal name, in every message used: CRC-8/SAE-J1850")
    window_ms: float = Field(default=5.0, gt=0.0, le=1000.0, description="Longest time from a sample's first frame to its last")


class CanBackend(DbcLayout):
    """Encoders on a CAN bus (needs the extra `can`)."""

    backend: Literal["can"]
    bus: CanBus


class CanLogBackend(DbcLayout):
    """A CAN log, .asc, .blf or another that python-can reads, in place of a bus (needs the extra `can`)."""

    backend: Literal["can_log"]
    path: str = Field(description="The log, relative to the station file")


class CanopenBackend(HardwareEncoders):
    """CANopen encoders, CiA 406, one node per joint; `source` is the node id (needs the extra `can`)."""

    backend: Literal["canopen"]
    bus: CanBus
    tpdo: int = Field(default=1, ge=1, le=4, description="Transmit PDO with the position value 6004h")
    setup: Literal["read", "configure", "assume"] = "read"
    sync_period_ms: int | None = Field(default=None, ge=1)
    event_timer_ms: int = Field(default=10, ge=1)
    window_ms: float = Field(default=5.0, gt=0.0, le=1000.0)


class ArmeoBackend(HardwareEncoders):
    """A CSV export of Armeocontrol in place of a device; `source` is the title of a column."""

    backend: Literal["armeo"]
    path: str = Field(description="The export, relative to the station file")
    time_column: str = "Timestamp"
    delimiter: str = Field(default=";", min_length=1, max_length=1)


HardwareEncoderBackend = SerialBackend | CanBackend | CanLogBackend | CanopenBackend | ArmeoBackend
