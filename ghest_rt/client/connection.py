"""One Zenoh session to one endpoint: opened again and again until it stands, then kept by Zenoh itself."""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING

import zenoh

from ghest_rt.client.sequence import FillRequest
from ghest_rt.errors import GhestError
from ghest_rt.security.session import open_session

if TYPE_CHECKING:
    from ghest_rt.security.identity import Identity

_log = logging.getLogger(__name__)

_RETRY_S = 0.3
_ANSWER_WITHIN_S = 2.0
_CLOSE_WITHIN_S = 2.0


class Kind(Enum):
    """What arrived."""

    SAMPLE = auto()
    HEALTH = auto()
    EVENT = auto()
    TOKEN = auto()
    TOKEN_GONE = auto()
    LAST = auto()  # answer to the question for the last sample
    FILLED = auto()  # answer to a `FillRequest`
    CONNECTED = auto()
    DISCONNECTED = auto()


@dataclass(frozen=True, slots=True)
class Arrival:
    """Something that a session delivered, stamped on a thread of Zenoh's.

    Attributes:
        kind: What.
        endpoint: Over which connection.
        station: Of which station; empty for the connection itself.
        payload: As it came; for `DISCONNECTED` the reason.
        request: What it answers.
    """

    kind: Kind
    endpoint: str
    station: str = ""
    payload: bytes = b""
    request: FillRequest | None = None


_TAILS = {"gh/angles": Kind.SAMPLE, "health": Kind.HEALTH, "events": Kind.EVENT}


class Connection:
    """Subscribes to everything of some stations and passes it on with `deliver`, which must not block."""

    def __init__(
        self, endpoint: str, stations: Sequence[str], identity: "Identity | None", deliver: Callable[[Arrival], None]
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            endpoint: Like "tcp/127.0.0.1:7447".
            stations: Ids, or "*" for all.
            identity: Who we are, for endpoints with TLS.
            deliver: Called on threads of Zenoh's.
        """
        self._endpoint = endpoint
        self._stations = stations
        self._identity = identity
        self._deliver = deliver
        self._stop = threading.Event()
        self._ready = threading.Event()
        self._session: zenoh.Session | None = None
        self._thread = threading.Thread(target=self._open, name=f"ghest-client {endpoint}", daemon=True)

    def start(self) -> None:
        """Begin to connect."""
        self._thread.start()

    def close(self) -> None:
        """Give up the session."""
        self._stop.set()
        self._thread.join(_CLOSE_WITHIN_S)
        if self._session is not None:
            self._session.close()  # type: ignore[no-untyped-call]

    def ask_last(self, station: str) -> None:
        """Ask a station for its last sample; the answer is delivered."""

        def take(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._deliver(Arrival(Kind.LAST, self._endpoint, station, reply.ok.payload.to_bytes()))

        self._get(f"ghest/{station}/last", take)

    def ask_for(self, request: FillRequest) -> None:
        """Ask a station for missing samples; the answer is delivered."""

        def take(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                self._deliver(Arrival(Kind.FILLED, self._endpoint, request.station, reply.ok.payload.to_bytes(), request))

        parameters = f"run_id={request.run_id};first={request.first_seq};last={request.last_seq}"
        self._get(f"ghest/{request.station}/gh/recent?{parameters}", take)

    def ask(self, station: str, what: str, timeout_s: float) -> bytes | None:
        """Ask a station for one of its documents and wait, also for the connection; None without an answer."""
        if not self._ready.wait(timeout_s) or self._session is None:
            return None
        for reply in self._session.get(f"ghest/{station}/{what}", timeout=timeout_s):
            if reply.ok is not None:
                return bytes(reply.ok.payload.to_bytes())
        return None

    def _get(self, selector: str, take: Callable[[zenoh.Reply], None]) -> None:
        if self._session is None:
            return
        try:
            self._session.get(selector, take, timeout=_ANSWER_WITHIN_S)
        except zenoh.ZError as error:
            _log.debug("%s: %s: %s", self._endpoint, selector, error)

    def _open(self) -> None:
        told = ""
        while not self._stop.is_set():
            try:
                self._session, _ = open_session(connect=(self._endpoint,), identity=self._identity, mode="client")
                self._subscribe(self._session)
            except (GhestError, zenoh.ZError) as error:
                if str(error) != told:
                    told = str(error)
                    self._deliver(Arrival(Kind.DISCONNECTED, self._endpoint, payload=told.encode()))
                self._stop.wait(_RETRY_S)
            else:
                self._ready.set()
                return

    def _subscribe(self, session: zenoh.Session) -> None:
        session.info.declare_transport_events_listener(self._on_transport, history=True)
        for station in self._stations:
            for tail, kind in _TAILS.items():
                session.declare_subscriber(f"ghest/{station}/{tail}", self._taker(kind))
            session.liveliness().declare_subscriber(f"ghest/{station}/alive", self._on_token, history=True)

    def _taker(self, kind: Kind) -> Callable[[zenoh.Sample], None]:
        def take(sample: zenoh.Sample) -> None:
            self._deliver(Arrival(kind, self._endpoint, _station_of(sample), sample.payload.to_bytes()))

        return take

    def _on_token(self, sample: zenoh.Sample) -> None:
        kind = Kind.TOKEN if sample.kind == zenoh.SampleKind.PUT else Kind.TOKEN_GONE
        self._deliver(Arrival(kind, self._endpoint, _station_of(sample)))

    def _on_transport(self, event: zenoh.TransportEvent) -> None:
        if event.kind == zenoh.SampleKind.PUT:
            self._deliver(Arrival(Kind.CONNECTED, self._endpoint))
        else:
            self._deliver(Arrival(Kind.DISCONNECTED, self._endpoint, payload=b"the connection was closed or broke"))


def _station_of(sample: zenoh.Sample) -> str:
    return str(sample.key_expr).split("/", 2)[1]
