"""`ghest-rt status`: which stations are alive and how they are, read from what they publish."""

import json
import time
from pathlib import Path

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from ghest_rt.cli.console import print_json, printing
from ghest_rt.cli.station_watch import StationState, StationWatch
from ghest_rt.errors import DeviceError
from ghest_rt.messages.published import Health, InputState
from ghest_rt.messages.results import Reason, Status
from ghest_rt.service.stop_signals import StopSignals

_POLL_S = 0.05
_STATUS_STYLE = {Status.VALID: "bold green", Status.DEGRADED: "bold yellow", Status.LOST: "bold red"}


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
        GhestError: The extra `security` is needed and not installed.
    """
    with StopSignals() as stop, StationWatch(endpoints, station, identity, time.monotonic) as known:
        _wait_for_all(known, wait_s, stop)
        if watch:
            _watch(known, stop, as_json)
        stations, troubles, now_s = known.stations(), known.troubles(), time.monotonic()
    if watch:
        return
    if as_json:
        print_json(document(stations, now_s))
    else:
        with printing():
            Console().print(page(stations, now_s))
    if not any(state.alive for state in stations.values()):
        named = "" if station == "*" else f"{station} "
        why = "; ".join(troubles) or "is the service running?"
        raise DeviceError(f"no station {named}is alive on {', '.join(endpoints)}: {why}")


def _wait_for_all(known: StationWatch, wait_s: float, stop: StopSignals) -> None:
    """Wait until every station that is alive has told its health; one that hangs never does."""
    deadline_s = time.monotonic() + wait_s
    while time.monotonic() < deadline_s and not stop.is_set():
        alive = [state for state in known.stations().values() if state.alive]
        if alive and all(state.health is not None for state in alive):
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
            f"p99.9 {recent.p999_us / 1000:.2f}  max {recent.max_us / 1000:.2f} ms"
        ),
        Text(f"since the start: p99 {health.lateness.p99_us / 1000:.2f}  max {health.lateness.max_us / 1000:.2f} ms"),
        Text(
            f"CPU {health.cpu_percent:.0f} % · {health.memory_mb:.0f} MB · {health.threads} threads · {health.open_files} files"
        ),
        *_inputs(health),
    ]
    lines += [Text(f"{event.source}: {event.kind.replace('_', ' ')}: {event.message}", style="dim") for event in state.events]
    return lines


def _inputs(health: Health) -> list[RenderableType]:
    """Return a table that fits in 80 columns, and the reasons for what was refused."""
    warm = any(item.temperature_c is not None for item in health.inputs.values())
    table = Table(box=None, header_style="dim", padding=(0, 1, 0, 0), pad_edge=False)
    columns = ("input", "state", "Hz", "age ms", "received", "missing", "skipped", "bad", "reopened", "refused")
    for column in (*columns, "°C") if warm else columns:
        table.add_column(column, justify="left" if column in {"input", "state"} else "right")
    for name, item in health.inputs.items():
        counts = (item.received, item.missing, item.skipped, item.bad, item.reopened, sum(item.refused.values()))
        table.add_row(
            name,
            Text(item.state, style="green" if item.state is InputState.STREAMING else "red"),
            f"{item.rate_hz:.1f}",
            "–" if item.age_ms is None else f"{item.age_ms:.0f}",
            *map(str, counts),
            *(["–" if item.temperature_c is None else f"{item.temperature_c:.0f}"] if warm else []),
        )
    refused = {name: item.refused for name, item in health.inputs.items() if item.refused}
    reasons = [
        Text(f"{name} refused: " + ", ".join(f"{reason} {count}" for reason, count in counts.items()))
        for name, counts in refused.items()
    ]
    return [table, *reasons]


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {rest:02d} s"
