"""What a client is told."""

from dataclasses import dataclass
from enum import StrEnum

from ghest_rt.messages.published import Event, GhAngles, Health


@dataclass(frozen=True, slots=True)
class Sample:
    """A sample as received; without angles if its status is `lost`.

    Attributes:
        station: Whose.
        message: The message itself.
        t_received_ns: When it came, receiver's monotonic clock.
        delay_ms: How much later it came than the quickest of the last thousand or so (their least time on the way counts as
            none, so that no clocks need to agree); infinite if unknown.
        recovered: Whether it was asked for afterwards (it was missing, or published before we came) and so is old.
    """

    station: str
    message: GhAngles
    t_received_ns: int
    delay_ms: float
    recovered: bool = False

    def age_s(self, now_ns: int) -> float:
        """Return how old the angles are: the station's own lag, the delay on the way, and the time since they came.

        Args:
            now_ns: Receiver's monotonic clock (`time.monotonic_ns()`).
        """
        lag_ns = self.message.t_publish_ns - self.message.t_sample_ns
        return self.delay_ms * 1e-3 + (lag_ns + now_ns - self.t_received_ns) * 1e-9


class GapCause(StrEnum):
    """Why samples are missing."""

    UNFILLED = "unfilled"  # lost on the way, and the station no longer has them or did not answer
    OVERRUN = "overrun"  # they came, but the receiving program did not take them in time


@dataclass(frozen=True, slots=True)
class Gap:
    """Samples of a run that will not come any more.

    Attributes:
        station: Whose.
        run_id: Of which run.
        first_seq: The first missing one.
        last_seq: The last missing one.
        cause: Why.
    """

    station: str
    run_id: str
    first_seq: int
    last_seq: int
    cause: GapCause

    @property
    def count(self) -> int:
        """How many are missing."""
        return self.last_seq - self.first_seq + 1


@dataclass(frozen=True, slots=True)
class Restarted:
    """Another run counts from 0 again: the service was started anew. Not a gap.

    Attributes:
        station: Whose.
        run_id: Of the new run.
        first_seq: The first sample of it that reached us.
    """

    station: str
    run_id: str
    first_seq: int


class LinkState(StrEnum):
    """Whether a station's newest sample can be taken for the present."""

    LIVE = "live"
    STALE = "stale"
    LOST = "lost"


class LinkCause(StrEnum):
    """Why a station is not live."""

    NONE = "none"
    SILENT = "silent"  # the connection stands, but nothing comes
    DELAYED = "delayed"  # what comes was published long ago
    SERVICE_GONE = "service_gone"  # its liveliness token was withdrawn
    NO_CONNECTION = "no_connection"


@dataclass(frozen=True, slots=True)
class LinkChanged:
    """A station became live, stale or lost.

    Attributes:
        station: Which.
        state: What it is now.
        cause: Why.
        t_ns: Since when, receiver's monotonic clock.
    """

    station: str
    state: LinkState
    cause: LinkCause
    t_ns: int


@dataclass(frozen=True, slots=True)
class ConnectionChanged:
    """The connection to an endpoint stands or is gone; it is tried again all the time.

    Attributes:
        endpoint: Which.
        connected: Whether it stands.
        detail: Why not; empty if it stands.
    """

    endpoint: str
    connected: bool
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Refused:
    """Messages that are not taken; told once for every reason.

    Attributes:
        station: Whose.
        detail: What is wrong with them and what to do.
    """

    station: str
    detail: str


@dataclass(frozen=True, slots=True)
class HealthReport:
    """How a station's service is doing, once a second."""

    station: str
    message: Health


@dataclass(frozen=True, slots=True)
class EventReport:
    """Something happened at a station.

    Attributes:
        station: Which.
        message: What.
        missed: Events between the one before and this one that did not reach us; the station keeps none.
    """

    station: str
    message: Event
    missed: int = 0


Update = Sample | Gap | Restarted | LinkChanged | ConnectionChanged | Refused | HealthReport | EventReport
