"""The client that programs use."""

import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from ghest_rt.client.connection import Connection
from ghest_rt.client.hub import Hub
from ghest_rt.client.limits import Limits
from ghest_rt.client.mailbox import CAPACITY, CallbackThread, Updates
from ghest_rt.client.names import check_station
from ghest_rt.client.station_tracker import StationTracker
from ghest_rt.client.updates import LinkChanged, LinkState, Sample, Update
from ghest_rt.errors import BadInputError, GhestError
from ghest_rt.extras import need_extra
from ghest_rt.security.session import session_settings

if TYPE_CHECKING:
    from ghest_rt.security.identity import Identity


class GhestClient:
    """The angles of one or several stations, as long as the context is entered.

    Three ways to take them, which can be used at once: `latest` for a loop that draws pictures, `updates` for everything in
    order, with or without asyncio, and `on_update` for a callback. Connections are made again by themselves; a station that is
    not there yet is waited for. No clocks need to agree.
    """

    def __init__(
        self,
        connect: str | Sequence[str] = "tcp/127.0.0.1:7447",
        *,
        stations: str | Sequence[str] = "*",
        identity: Path | None = None,
        fill_gaps: bool = True,
        limits: Limits | None = None,
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            connect: Where stations or routers listen.
            stations: Their ids, or "*" for every one found there.
            identity: Folder of `ghest-rt certs issue`, for endpoints with TLS (needs the extra `security`).
            fill_gaps: Whether to ask for samples that did not come; newer ones wait for them in `updates`, not in `latest`.
            limits: What counts as late, stale and lost.
            now_ns: Monotonic clock.

        Raises:
            BadInputError: An endpoint or station id is malformed; the identity cannot be used.
            GhestError: The extra `security` is missing.
        """
        endpoints = (connect,) if isinstance(connect, str) else tuple(connect)
        names = (stations,) if isinstance(stations, str) else tuple(stations)
        for name in names:
            check_station(name)
        who = None if identity is None else _load(identity)
        for endpoint in endpoints:
            session_settings((), (endpoint,), who, "client")
        self._now_ns = now_ns
        self._hub = Hub([name for name in names if name != "*"], Limits() if limits is None else limits, fill_gaps, now_ns)
        self._connections = {endpoint: Connection(endpoint, names, who, self._hub.deliver) for endpoint in endpoints}

    def __enter__(self) -> Self:
        self._hub.start(self._connections)
        for connection in self._connections.values():
            connection.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    async def __aenter__(self) -> Self:
        return self.__enter__()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close all connections; whoever waits for updates gets the end."""
        for connection in self._connections.values():
            connection.close()
        self._hub.stop()

    def updates(self, capacity: int = CAPACITY) -> Updates:
        """Return everything from now on, beginning with the state and the newest sample of every station.

        Args:
            capacity: How many updates wait for a receiver that does not take them, before the oldest are dropped.
        """
        receiver = Updates(capacity)
        self._hub.join(receiver)
        return receiver

    def on_update(self, callback: Callable[[Update], None], capacity: int = CAPACITY) -> CallbackThread:
        """Call `callback` with every update, on a thread of its own, until the returned object is closed."""
        return CallbackThread(self.updates(capacity), callback)

    def latest(self, station: str | None = None, max_age_s: float = 0.2) -> Sample | None:
        """Return the newest sample of a live station, or None: never an old one as if it were new.

        Args:
            station: Which; None if there is only one.
            max_age_s: Samples of an instant longer ago are not returned.

        Raises:
            BadInputError: There are several stations, and none is named.
        """
        tracker = self._tracker(station)
        if tracker is None or tracker.link.state is not LinkState.LIVE:
            return None
        sample = tracker.newest
        return sample if sample is not None and sample.age_s(self._now_ns()) <= max_age_s else None

    def link(self, station: str | None = None) -> LinkChanged | None:
        """Return whether a station is live, stale or lost; None if it was never seen.

        Raises:
            BadInputError: There are several stations, and none is named.
        """
        tracker = self._tracker(station)
        return None if tracker is None else tracker.link

    def stations(self) -> tuple[str, ...]:
        """Return the stations seen so far."""
        return tuple(sorted(self._hub.trackers))

    def ask(self, station: str, what: str, timeout_s: float = 3.0) -> object:
        """Ask a station for a document and wait: `config`, `calibration`, `schema` or `last`.

        Raises:
            GhestError: No answer came.
        """
        for connection in self._connections.values():
            answer = connection.ask(station, what, timeout_s)
            if answer is not None:
                document: object = json.loads(answer)
                return document
        raise GhestError(f"station {station} does not answer the question for {what}: is it running, and may you ask?")

    def _tracker(self, station: str | None) -> StationTracker | None:
        trackers = self._hub.trackers
        if station is None:
            if len(trackers) > 1:
                raise BadInputError(f"name one of the stations {', '.join(sorted(trackers))}")
            station = next(iter(trackers), "")
        return trackers.get(station)


def _load(identity: Path) -> "Identity":
    need_extra("security", "a connection with TLS")
    from ghest_rt.security.identity_check import load_identity  # noqa: PLC0415  (needs the extra)

    return load_identity(identity)
