"""What camera and encoder workers have in common: settings, counters, and whom they tell."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, Protocol

from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample
from ghest_rt.messages.published import EventKind, InputState
from ghest_rt.messages.results import MarkerObservation

Severity = Literal["info", "warning", "error"]


@dataclass(frozen=True, slots=True)
class Backoff:
    """Growing pauses between attempts to open a device again.

    Attributes:
        first_s: The first pause.
        limit_s: The longest.
        factor: From one to the next.
    """

    first_s: float = 0.25
    limit_s: float = 5.0
    factor: float = 2.0

    def delays_s(self) -> Iterator[float]:
        """Yield pauses without end."""
        delay_s = self.first_s
        while True:
            yield delay_s
            delay_s = min(delay_s * self.factor, self.limit_s)


@dataclass(frozen=True, slots=True)
class InputSettings:
    """How an input is watched.

    Attributes:
        read_timeout_s: How long one read waits.
        silent_after: Reads in vain until the input is reported as silent.
        lost_after: Reads in vain until the device is closed and opened again.
        max_backlog_ns: A frame that has waited longer than this since its arrival gives way to a newer one.
        settled_after_ns: Frames passed over so soon after the first are only counted: they waited for what is done once.
        reconnect: Whether a lost device is opened again; if not (recordings), the input has ended with an error.
        backoff: The pauses before that.
    """

    read_timeout_s: float = 0.25
    silent_after: int = 2
    lost_after: int = 20
    max_backlog_ns: int = 30_000_000
    settled_after_ns: int = 1_000_000_000
    reconnect: bool = True
    backoff: Backoff = Backoff()


@dataclass(slots=True)
class InputCounters:
    """What one input has done so far; written by its worker alone."""

    state: InputState = InputState.CONNECTING
    received: int = 0
    missing: int = 0
    skipped: int = 0
    bad: int = 0
    reopened: int = 0
    last_seq: int | None = None
    newest_ns: int | None = None

    def count(self, seq: int, t_capture_ns: int) -> None:
        """Count a sample received, and the gap before it in the device's own numbering."""
        self.received += 1
        self.newest_ns = t_capture_ns
        if self.last_seq is not None and seq > self.last_seq + 1:
            self.missing += seq - self.last_seq - 1
        self.last_seq = seq


class InputListener(Protocol):
    """Whom a worker tells; every method is called on the event loop's thread."""

    def input_event(self, source: str, kind: EventKind, severity: Severity, message: str) -> None:
        """Something happened to the input `source`."""
        ...

    def camera_connected(self, name: str, info: CameraInfo) -> None:
        """A camera is open."""
        ...

    def encoders_connected(self, info: EncoderInfo) -> None:
        """The encoder link is open."""
        ...

    def observed(self, observation: MarkerObservation) -> None:
        """A frame has been through vision."""
        ...

    def encoder_sample(self, sample: EncoderSample) -> None:
        """An encoder sample has arrived."""
        ...

    def input_ended(self, source: str, error: Exception | None) -> None:
        """The input will deliver nothing more: it is through, or broke and is not opened again."""
        ...
