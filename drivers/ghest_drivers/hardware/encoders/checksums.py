"""Checksums of encoder frames and lines. Each takes bytes and returns an unsigned integer."""

import binascii
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from operator import xor


@dataclass(frozen=True, slots=True)
class Checksum:
    """One algorithm.

    Attributes:
        size_bytes: Length of the result.
        compute: The algorithm.
    """

    size_bytes: int
    compute: Callable[[bytes], int]


def _table(polynomial: int, width: int, reflected: bool) -> tuple[int, ...]:
    top, mask = 1 << (width - 1), (1 << width) - 1
    table = []
    for byte in range(256):
        value = byte if reflected else byte << (width - 8)
        for _ in range(8):
            if reflected:
                value = (value >> 1) ^ (polynomial if value & 1 else 0)
            else:
                value = ((value << 1) & mask) ^ (polynomial if value & top else 0)
        table.append(value)
    return tuple(table)


_MODBUS = _table(0xA001, 16, reflected=True)
_J1850 = _table(0x1D, 8, reflected=False)


def crc16_modbus(data: bytes) -> int:
    """CRC-16/MODBUS: polynomial 0x8005 reflected, start 0xFFFF."""
    value = 0xFFFF
    for byte in data:
        value = (value >> 8) ^ _MODBUS[(value ^ byte) & 0xFF]
    return value


def crc8_j1850(data: bytes) -> int:
    """CRC-8/SAE-J1850: polynomial 0x1D, start and final XOR 0xFF."""
    value = 0xFF
    for byte in data:
        value = _J1850[value ^ byte]
    return value ^ 0xFF


def crc16_ccitt(data: bytes) -> int:
    """CRC-16/CCITT-FALSE (IBM-3740): polynomial 0x1021, start 0xFFFF."""
    return binascii.crc_hqx(data, 0xFFFF)


def xor8(data: bytes) -> int:
    """All bytes by exclusive or, as in NMEA 0183."""
    return reduce(xor, data, 0)


CHECKSUMS: dict[str, Checksum] = {
    "crc32": Checksum(4, binascii.crc32),
    "crc16_ccitt": Checksum(2, crc16_ccitt),
    "crc16_modbus": Checksum(2, crc16_modbus),
    "crc8_j1850": Checksum(1, crc8_j1850),
    "xor8": Checksum(1, xor8),
}
