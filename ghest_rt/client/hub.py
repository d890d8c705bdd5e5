"""The thread between the connections and the receivers: it alone touches the trackers."""

import logging
import queue
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from ghest_rt.client.connection import Arrival, Connection, Kind
from ghest_rt.client.limits import Limits
from ghest_rt.client.mailbox import Updates
from ghest_rt.client.reading import RefusedError, read_message, read_page
from ghest_rt.client.station_tracker import StationTracker
from ghest_rt.client.updates import ConnectionChanged, EventReport, HealthReport, Refused, Sample, Update
from ghest_rt.messages.published import Event, GhAngles, Health

_log = logging.getLogger(__name__)

_BACKLOG: Final = 20_000
_IDLE_S: Final = 0.5
_END_WITHIN_S: Final = 2.0
_MOST_STATIONS: Final = 256  # a peer that makes up names shall not fill the memory
_MOST_COMPLAINTS: Final = 1000


class Hub:
    """Takes arrivals and receivers from any thread, and tells every receiver every update in the same order.

    Attributes:
        trackers: By station; other threads may look up and read.
    """

    def __init__(self, named: Sequence[str], limits: Limits, fill: bool, now_ns: Callable[[], int]) -> None:
        """Prepare.

        Args:
            named: Stations to speak of before anything came from them.
            limits: What counts as late, stale and lost.
            fill: Whether to ask for missing samples.
            now_ns: Monotonic clock.
        """
        self.trackers: dict[str, StationTracker] = {}
        self._limits = limits
        self._fill = fill
        self._now_ns = now_ns
        self._items: queue.Queue[tuple[int, Arrival] | Updates | None] = queue.Queue(_BACKLOG)
        self._connections: Mapping[str, Connection] = {}
        self._connected: dict[str, ConnectionChanged] = {}
        self._last_told: dict[str, Sample] = {}
        self._last_events: dict[str, Event] = {}
        self._refused: set[Refused] = set()
        self._receivers: tuple[Updates, ...] = ()
        self._thread = threading.Thread(target=self._work, name="ghest-client", daemon=True)
        for station in named:
            self._tracker(station)

    def start(self, connections: Mapping[str, Connection]) -> None:
        """Begin, with the connections through which stations can be asked, by endpoint."""
        self._connections = connections
        self._thread.start()

    def stop(self) -> None:
        """End; receivers read what has come and then the end."""
        self._items.put(None)
        self._thread.join(_END_WITHIN_S)

    def deliver(self, arrival: Arrival) -> None:
        """Take what came. If this program hung, samples are dropped here and asked for later."""
        try:
            self._items.put_nowait((self._now_ns(), arrival))
        except queue.Full:
            _log.debug("too much waits to be read: %s dropped", arrival.kind)

    def join(self, receiver: Updates) -> None:
        """Tell a receiver everything from now on, beginning with how things stand."""
        self._items.put(receiver)

    def _work(self) -> None:
        try:
            while self._take():
                self._look_at_clock()
        finally:
            for receiver in self._receivers:
                receiver.close()

    def _take(self) -> bool:
        """Wait for the next item and see to it; false at the end."""
        try:
            item = self._items.get(timeout=self._pause_s())
        except queue.Empty:
            return True
        if isinstance(item, Updates):
            self._welcome(item)
        elif item is not None:
            self._handle(*item)
        return item is not None

    def _pause_s(self) -> float:
        deadlines = (tracker.deadline_ns for tracker in self.trackers.values())
        due_ns = min((deadline_ns for deadline_ns in deadlines if deadline_ns is not None), default=None)
        return _IDLE_S if due_ns is None else min(_IDLE_S, max(0.001, (due_ns - self._now_ns()) * 1e-9))

    def _look_at_clock(self) -> None:
        t_ns = self._now_ns()
        for tracker in tuple(self.trackers.values()):
            if tracker.deadline_ns is not None and tracker.deadline_ns <= t_ns:
                self._tell(tracker.on_time(t_ns))
            request = tracker.take_request()
            if request is not None:
                for connection in self._connections.values():
                    connection.ask_for(request)

    def _welcome(self, receiver: Updates) -> None:
        for change in self._connected.values():
            receiver.put(change)
        for tracker in self.trackers.values():
            receiver.put(tracker.link)
        for sample in self._last_told.values():
            receiver.put(sample)
        self._receivers = (*self._receivers, receiver)

    def _tell(self, updates: Sequence[Update]) -> None:
        for update in updates:
            if isinstance(update, Sample):
                self._last_told[update.station] = update
            elif isinstance(update, Refused):
                if update in self._refused or len(self._refused) >= _MOST_COMPLAINTS:
                    continue
                self._refused.add(update)
            self._receivers = tuple([receiver for receiver in self._receivers if receiver.put(update)])

    def _handle(self, t_ns: int, arrival: Arrival) -> None:
        if arrival.station and arrival.station not in self.trackers:
            if len(self.trackers) >= _MOST_STATIONS:
                return
            self._tracker(arrival.station)
        try:
            self._tell(self._read(t_ns, arrival))
        except RefusedError as error:
            self._tell([Refused(arrival.station, str(error))])

    def _read(self, t_ns: int, arrival: Arrival) -> list[Update]:
        match arrival.kind:
            case Kind.CONNECTED | Kind.DISCONNECTED:
                return self._on_connection(t_ns, arrival)
            case Kind.HEALTH:
                return [HealthReport(arrival.station, read_message(Health, arrival.payload))]
            case Kind.EVENT:
                return [self._event(arrival.station, read_message(Event, arrival.payload))]
            case Kind.TOKEN | Kind.TOKEN_GONE:
                return self._on_token(t_ns, arrival)
            case Kind.FILLED if arrival.request is not None:
                return self._tracker(arrival.station).on_filled(arrival.request, read_page(arrival.payload), t_ns)
        message = read_message(GhAngles, arrival.payload)
        tracker = self._tracker(arrival.station)
        return (
            tracker.on_last(message, t_ns) if arrival.kind is Kind.LAST else tracker.on_message(arrival.endpoint, message, t_ns)
        )

    def _event(self, station: str, message: Event) -> EventReport:
        before = self._last_events.get(station)
        self._last_events[station] = message
        if before is None or before.run_id != message.run_id:
            return EventReport(station, message)
        return EventReport(station, message, missed=max(0, message.seq - before.seq - 1))

    def _on_token(self, t_ns: int, arrival: Arrival) -> list[Update]:
        alive = arrival.kind is Kind.TOKEN
        if alive:
            self._connections[arrival.endpoint].ask_last(arrival.station)
        return self._tracker(arrival.station).on_token(arrival.endpoint, alive, t_ns)

    def _on_connection(self, t_ns: int, arrival: Arrival) -> list[Update]:
        change = ConnectionChanged(arrival.endpoint, arrival.kind is Kind.CONNECTED, arrival.payload.decode())
        if self._connected.get(arrival.endpoint) == change:
            return []
        self._connected[arrival.endpoint] = change
        updates: list[Update] = [change]
        for tracker in self.trackers.values():
            updates += tracker.on_connection(arrival.endpoint, change.connected, t_ns)
        return updates

    def _tracker(self, station: str) -> StationTracker:
        if station not in self.trackers:
            t_ns = self._now_ns()
            tracker = StationTracker(station, self._limits, self._fill, t_ns)
            for endpoint, change in self._connected.items():
                tracker.on_connection(endpoint, change.connected, t_ns)
            self.trackers = {**self.trackers, station: tracker}  # a new one: other threads may be reading
        return self.trackers[station]
