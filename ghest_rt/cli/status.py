"""`ghest-rt status`: which stations are alive and how they are, read from what they publish."""

import json
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import zenoh
from pydantic import ValidationError
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from ghest_rt.cli.console import print_json
from ghest_rt.client.names import check_station
from ghest_rt.errors import DeviceError
from ghest_rt.messages.published import Event, Health, InputState
from ghest_rt.messages.results import Reason, Status
from ghest_rt.security.identity import use_identity
from ghest_rt.security.session import open_session
from ghest_rt.service.stop_signals import StopSignals

_POLL_S = 0.05
_SILENT_AFTER_S = 3.0  # health comes once a second
_STATUS_STYLE = {Status.VALID: "bold green", Status.DEGRADED: "bold yellow", Status.LOST: "bold red"}
_KEPT_EVENTS = 3


@dataclass(slots=True)
class StationState:
    """What is known of a station.

    Attributes:
        alive: Whether its liveliness token is there.
        health: Its newest message.
        t_health_s: When that came, monotonic clock of this process.
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
    """Collects what stations say; Zenoh calls on threads of its own."""

    def __init__(self, station: str) -> None:
        self._station = station
        self._lock = threading.Lock()
        self._stations: dict[str, StationState] = {}

    def listen(self, session: zenoh.Session) -> list[object]:
        """Subscribe; what is returned must be kept."""
        prefix = f"ghest/{self._station}"
        return [
            session.declare_subscriber(f"{prefix}/health", self._on_health),
            session.declare_subscriber(f"{prefix}/events", self._on_event),
            session.liveliness().declare_subscriber(f"{prefix}/alive", self._on_token, history=True),
        ]

    def stations(self) -> dict[str, StationState]:
        """Return a copy of what is known, by name."""
        with self._lock:
            return {
                name: StationState(state.alive, state.health, state.t_health_s, state.events)
                for name, state in sorted(self._stations.items())
            }

    def _state(self, sample: zenoh.Sample) -> StationState:
        return self._stations.setdefault(str(sample.key_expr).split("/")[1], StationState())

    def _on_health(self, sample: zenoh.Sample) -> None:
        try:
            message = Health.model_validate_json(sample.payload.to_bytes())
        except ValidationError:  # of another version: its token still tells that it lives
            return
        with self._lock:
            state = self._state(sample)
            state.health, state.t_health_s = message, time.monotonic()

    def _on_event(self, sample: zenoh.Sample) -> None:
        try:
            message = Event.model_validate_json(sample.payload.to_bytes())
        except ValidationError:
            return
        with self._lock:
            state = self._state(sample)
            state.events = (*state.events, message)[-_KEPT_EVENTS:]

    def _on_token(self, sample: zenoh.Sample) -> None:
        with self._lock:
            self._state(sample).alive = sample.kind == zenoh.SampleKind.PUT


def show_status(
    endpoints: tuple[str, ...], station: str, *, identity: Path | None, wait_s: float, watch: bool, as_json: bool
) -> None:
    """Print how the stations are; once, or until a signal comes.

    Args:
        endpoints: Where to ask: of services, or of a router.
        station: Of this station only; "*" of all.
        identity: Folder of who asks, for TLS.
        wait_s: How long to wait for what they say.
        watch: Go on and draw anew.
        as_json: One JSON document (while watching: one a second, a line each).

    Raises:
        BadInputError: An endpoint or the station's id is malformed, or the identity cannot be used.
        DeviceError: No station is alive.
        GhestError: Zenoh cannot open a session.
    """
    known = StationWatch(check_station(station))
    session, _ = open_session(connect=endpoints, identity=None if identity is None else use_identity(identity))
    with StopSignals() as stop, session:
        kept = known.listen(session)
        _wait_for_all(known, wait_s, stop)
        if watch:
            _watch(known, stop, as_json)
        stations, now_s = known.stations(), time.monotonic()
        del kept
    if watch:
        return
    if as_json:
        print_json(document(stations, now_s))
    else:
        Console().print(page(stations, now_s))
    if not any(state.alive for state in stations.values()):
        where = ", ".join(endpoints)
        raise DeviceError(f"no station {'' if station == '*' else station + ' '}is alive on {where}: is the service running?")


def _wait_for_all(known: StationWatch, wait_s: float, stop: StopSignals) -> None:
    """Wait until every station that is alive has told its health; one that hangs never does."""
    deadline_s = time.monotonic() + wait_s
    while time.monotonic() < deadline_s and not stop.is_set():
        stations = known.stations().values()
        if stations and all(state.health is not None for state in stations if state.alive):
            return
        time.sleep(_POLL_S)


def _watch(known: StationWatch, stop: StopSignals, as_json: bool) -> None:
    if as_json:
        while not stop.is_set():
            Console().out(json.dumps(document(known.stations(), time.monotonic())), highlight=False)
            _sleep(1.0, stop)
        return
    with Live(get_renderable=lambda: page(known.stations(), time.monotonic()), refresh_per_second=2):
        while not stop.is_set():
            time.sleep(_POLL_S)


def _sleep(seconds: float, stop: StopSignals) -> None:
    deadline_s = time.monotonic() + seconds
    while time.monotonic() < deadline_s and not stop.is_set():
        time.sleep(_POLL_S)


def document(stations: dict[str, StationState], now_s: float) -> dict[str, object]:
    """Return everything as what `--json` prints."""
    return {
        "stations": {
            name: {
                "alive": state.alive,
                "silent_s": state.silent_s(now_s),
                "health": None if state.health is None else state.health.model_dump(mode="json"),
                "events": [event.model_dump(mode="json") for event in state.events],
            }
            for name, state in stations.items()
        }
    }


def page(stations: dict[str, StationState], now_s: float) -> RenderableType:
    """Return everything for people."""
    if not stations:
        return Text("no station", style="bold red")
    parts: list[RenderableType] = []
    for name, state in stations.items():
        parts += [_head(name, state, now_s), *_details(state), Text("")]
    return Group(*parts[:-1])


def _head(name: str, state: StationState, now_s: float) -> Text:
    head = Text.assemble((name, "bold"), "  ")
    silent_s = state.silent_s(now_s)
    if not state.alive:
        return head.append("gone", style="bold red")
    if state.health is None:
        return head.append("alive, but tells nothing", style="bold yellow")
    if silent_s is not None:
        return head.append(f"silent for {silent_s:.0f} s: the loop hangs, or the connection", style="bold red")
    health = state.health
    reason = "" if health.reason is Reason.NONE else f" ({health.reason})"
    return head.append(f"{health.status}{reason}", style=_STATUS_STYLE[health.status])


def _details(state: StationState) -> list[RenderableType]:
    health = state.health
    if health is None:
        return []
    share = 100.0 * health.valid / health.published if health.published else 0.0
    recent = health.lateness_recent or health.lateness
    lines: list[RenderableType] = [
        Text(
            f"{health.rate_hz:.2f} Hz · {health.published} samples, {share:.1f} % valid · "
            f"up {_duration(health.uptime_s)} · missed {health.missed_ticks}"
        ),
        Text(
            f"late, last minute: p50 {recent.p50_us / 1000:.2f}  p99 {recent.p99_us / 1000:.2f}  "
            f"p99.9 {recent.p999_us / 1000:.2f}  max {recent.max_us / 1000:.2f} ms · "
            f"since start: p99 {health.lateness.p99_us / 1000:.2f}  max {health.lateness.max_us / 1000:.2f} ms"
        ),
        Text(
            f"CPU {health.cpu_percent:.0f} % · {health.memory_mb:.0f} MB · {health.threads} threads · {health.open_files} files"
        ),
        _inputs(health),
    ]
    lines += [Text(f"{event.source}: {event.kind.replace('_', ' ')}: {event.message}", style="dim") for event in state.events]
    return lines


def _inputs(health: Health) -> Table:
    table = Table(box=None, header_style="dim", padding=(0, 2, 0, 0))
    for column in ("input", "state", "rate", "age", "received", "missing", "skipped", "bad", "reopened", "refused", "temp."):
        table.add_column(column, justify="left" if column in {"input", "state"} else "right")
    for name, item in health.inputs.items():
        table.add_row(
            name,
            Text(item.state, style="green" if item.state is InputState.STREAMING else "red"),
            f"{item.rate_hz:.1f} Hz",
            "–" if item.age_ms is None else f"{item.age_ms:.0f} ms",
            *(str(count) for count in (item.received, item.missing, item.skipped, item.bad, item.reopened)),
            ", ".join(f"{reason} {count}" for reason, count in item.refused.items()) or "–",
            "–" if item.temperature_c is None else f"{item.temperature_c:.0f} °C",
        )
    return table


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {rest:02d} s"
