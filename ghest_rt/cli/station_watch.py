"""What the stations behind one or several endpoints say of themselves, collected for `ghest-rt status`."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Self

from pydantic import ValidationError

from ghest_rt.client.connection import Arrival, Connection, Kind
from ghest_rt.client.names import check_station
from ghest_rt.messages.published import Event, Health
from ghest_rt.security.identity import use_identity
from ghest_rt.security.session import session_settings

_SILENT_AFTER_S = 3.0  # health comes once a second
_KEPT_EVENTS = 3
_KEPT = {Kind.TOKEN, Kind.TOKEN_GONE, Kind.HEALTH, Kind.EVENT}


@dataclass(frozen=True, slots=True)
class StationState:
    """What is known of a station.

    Attributes:
        alive: Whether its liveliness token is there.
        health: Its newest message.
        t_health_s: When that came, by the clock given to `StationWatch`.
        events: Its newest events, oldest first.
    """

    alive: bool = False
    health: Health | None = None
    t_health_s: float = 0.0
    events: tuple[Event, ...] = ()

    def silent_s(self, now_s: float) -> float | None:
        """Return for how long it has told nothing, if that is too long."""
        quiet_s = now_s - self.t_health_s
        return quiet_s if self.health is not None and quiet_s > _SILENT_AFTER_S else None


class StationWatch:
    """Listens to stations while the context is entered; connections are made again by themselves.

    Args:
        endpoints: Of services, routers or gateways.
        station: Only this one; "*" for all.
        identity: Folder of who asks, for TLS.
        clock_s: Monotonic clock, seconds.

    Raises:
        BadInputError: An endpoint, the station's id or the identity cannot be used.
        GhestError: The extra `security` is needed and not installed.
    """

    def __init__(self, endpoints: Sequence[str], station: str, identity: Path | None, clock_s: Callable[[], float]) -> None:
        check_station(station)
        who = None if identity is None else use_identity(identity)
        for endpoint in endpoints:
            session_settings((), (endpoint,), who, "client")
        self._clock_s = clock_s
        self._lock = threading.Lock()
        self._stations: dict[str, StationState] = {}
        self._troubles: dict[str, str] = {}
        self._connections = [Connection(endpoint, (station,), who, self._take) for endpoint in endpoints]

    def __enter__(self) -> Self:
        for connection in self._connections:
            connection.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        for connection in self._connections:
            connection.close()

    def stations(self) -> dict[str, StationState]:
        """Return what is known, by name."""
        with self._lock:
            return dict(sorted(self._stations.items()))

    def troubles(self) -> tuple[str, ...]:
        """Return why there is no connection, for every endpoint without one."""
        with self._lock:
            return tuple(self._troubles.values())

    def _take(self, arrival: Arrival) -> None:
        """Note something; called on threads of Zenoh's."""
        with self._lock:
            if arrival.kind is Kind.CONNECTED:
                self._troubles.pop(arrival.endpoint, None)
            elif arrival.kind is Kind.DISCONNECTED:
                self._troubles[arrival.endpoint] = arrival.payload.decode()
            elif arrival.kind in _KEPT:
                before = self._stations.get(arrival.station, StationState())
                self._stations[arrival.station] = self._with(before, arrival)

    def _with(self, state: StationState, arrival: Arrival) -> StationState:
        try:
            match arrival.kind:
                case Kind.TOKEN | Kind.TOKEN_GONE:
                    return replace(state, alive=arrival.kind is Kind.TOKEN)
                case Kind.HEALTH:
                    health = Health.model_validate_json(arrival.payload)
                    return replace(state, health=health, t_health_s=self._clock_s())
                case Kind.EVENT:
                    event = Event.model_validate_json(arrival.payload)
                    return replace(state, events=(*state.events, event)[-_KEPT_EVENTS:])
        except ValidationError:  # of another version: its token still tells that it lives
            pass
        return state
