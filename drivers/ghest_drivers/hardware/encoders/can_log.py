"""CAN logs (.asc, .blf, .log, .csv, … whatever python-can reads) as an encoder link."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ghest_drivers.clock import Clock
from ghest_drivers.errors import BadDeviceData, DeviceNotFound
from ghest_drivers.hardware.encoders.builder import SampleBuilder
from ghest_drivers.hardware.encoders.can_layout import CanDecoder, CanLayout
from ghest_drivers.hardware.encoders.channels import Channel
from ghest_drivers.hardware.encoders.file_link import FileEncoderLink
from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection
from ghest_drivers.installing import pip_install
from ghest_drivers.samples import EncoderSample

_NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class CanLogSettings:
    """Replay of a CAN log as an encoder link.

    Attributes:
        path: The log.
        layout: What it holds.
        channels: The encoders, in the order of the angles delivered.
        fault_mask: Bits of the status signal that mean that the angles are not to be trusted.
        paced: Deliver each sample when it is due; else at once.
    """

    path: Path
    layout: CanLayout
    channels: tuple[Channel, ...]
    fault_mask: int = -1
    paced: bool = True


def can_log_link(settings: CanLogSettings, clock: Clock) -> FileEncoderLink:
    """Return an encoder link that replays a CAN log.

    Raises:
        DeviceNotFound: python-can or cantools is not installed.
        BadDeviceData: The DBC file is not valid or lacks a signal.
    """
    CanDecoder(settings.layout, settings.channels, LinkStats())

    def samples(stats: LinkStats) -> Iterator[EncoderSample]:
        decoder = CanDecoder(settings.layout, settings.channels, stats)
        builder = SampleBuilder(settings.channels, decoder.counting(0, settings.fault_mask), stats)
        for message in _messages(settings.path):
            if message.is_error_frame:
                stats.rejected[Rejection.BAD_FRAME] += 1
                continue
            t_ns = round(message.timestamp * _NS_PER_S)
            whole = decoder.feed(message.arbitration_id, bytes(message.data), t_ns, t_ns)
            if whole is not None:
                sample = builder.build(whole[0], t_ns, whole[1])
                if sample is not None:
                    yield sample

    return FileEncoderLink(str(settings.path), settings.channels, samples, clock, paced=settings.paced)


def _messages(path: Path) -> Iterator[Any]:
    """Yield the messages of a log.

    Raises:
        BadDeviceData: The file is of no kind that python-can reads, or damaged.
    """
    try:
        import can  # noqa: PLC0415 - only where this backend is chosen
    except ImportError as error:
        raise DeviceNotFound(f"CAN logs need python-can: {pip_install('can')}") from error
    try:
        with can.LogReader(str(path)) as reader:
            yield from reader
    except OSError:
        raise
    except Exception as error:  # the readers raise whatever their parsing meets
        raise BadDeviceData(f"not a readable CAN log: {error}") from error
