"""`ghest-rt listen`: a small subscriber, to see that samples arrive."""

import signal
import sys
import threading
import time
from pathlib import Path

from ghest_rt.cli.station_watch import StationWatch
from ghest_rt.client import (
    ConnectionChanged,
    EventReport,
    Gap,
    GhestClient,
    LinkCause,
    LinkChanged,
    LinkState,
    Refused,
    Restarted,
    Sample,
    Update,
)
from ghest_rt.messages.published import GhAngles
from ghest_rt.messages.results import Reason

_POLL_S = 0.2
_HINT_AFTER_S = 3.0
_TOKENS_COME_WITHIN_S = 1.0
_CAUSES = {
    LinkCause.SILENT: "nothing comes, though the connection stands",
    LinkCause.DELAYED: "what comes was published long ago",
    LinkCause.SERVICE_GONE: "the service has ended",
    LinkCause.NO_CONNECTION: "no connection",
}


def listen_to(endpoint: str, station: str, identity: Path | None, count: int | None, as_json: bool) -> None:
    """Print samples as they arrive, until `count` have come or a signal asks to stop; all else goes to standard error.

    Raises:
        BadInputError: The endpoint, the station or the identity cannot be used.
    """
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: stop.set())
    received, lost, quiet_s, connected = 0, 0, 0.0, False
    with GhestClient(endpoint, stations=station, identity=identity) as client, client.updates() as updates:
        while not stop.is_set() and (count is None or received < count):
            update = updates.get(_POLL_S)
            if isinstance(update, Sample):
                quiet_s = 0.0
                received += 1
                sys.stdout.write((update.message.model_dump_json() if as_json else line_of(update.message)) + "\n")
                sys.stdout.flush()
                continue
            if isinstance(update, Gap):
                lost += update.count
            elif isinstance(update, ConnectionChanged):
                connected = update.connected
            told = None if update is None else note_of(update)
            if told is not None:
                sys.stderr.write(told + "\n")
            if update is None:
                quiet_s += _POLL_S
                if _HINT_AFTER_S <= quiet_s < _HINT_AFTER_S + _POLL_S:
                    sys.stderr.write(
                        (why_nothing_comes(endpoint, station, identity) if connected else _nobody(endpoint)) + "\n"
                    )
    sys.stderr.write(f"{received} samples received, {lost} lost\n")


def why_nothing_comes(endpoint: str, station: str, identity: Path | None) -> str:
    """Look for stations behind an endpoint that answers, and return what to tell somebody to whom nothing comes from there."""
    with StationWatch((endpoint,), "*", identity, time.monotonic) as known:
        deadline_s = time.monotonic() + _TOKENS_COME_WITHIN_S
        while time.monotonic() < deadline_s and station not in known.stations():
            time.sleep(_POLL_S / 4)
        alive = [name for name, state in known.stations().items() if state.alive]
    if station in alive or (alive and station == "*"):
        return f"{', '.join(alive) if station == '*' else station}: alive, but no sample comes; ghest-rt status says more"
    if alive:
        return f"no station {station} at {endpoint}; alive: {', '.join(alive)}"
    return f"connected to {endpoint}, but no station is alive there"


def _nobody(endpoint: str) -> str:
    return f"nothing arrives from {endpoint}; is a ghest-rt running there?"


def note_of(update: Update) -> str | None:
    """Return what is not a sample as one line of text; None if it is of no interest here."""
    match update:
        case Gap():
            return f"{update.station}: {update.count} samples missing, {update.first_seq} to {update.last_seq} ({update.cause})"
        case Restarted():
            return f"{update.station}: the service was started anew; sample {update.first_seq} is the first of it here"
        case LinkChanged(state=LinkState.LIVE):
            return f"{update.station}: live"
        case LinkChanged():
            return f"{update.station}: {update.state}: {_CAUSES[update.cause]}"
        case ConnectionChanged(connected=True):
            return f"connected to {update.endpoint}"
        case ConnectionChanged():
            return f"not connected to {update.endpoint}: {update.detail}"
        case Refused():
            return f"{update.station}: {update.detail}"
        case EventReport():
            return f"{update.station}: {update.message.severity}: {update.message.source}: {update.message.message}"
    return None


def line_of(message: GhAngles) -> str:
    """Return a sample as one line of text."""
    age_ms = max((age for age in message.age_ms.values() if age is not None), default=0.0)
    reason = "" if message.reason is Reason.NONE else f" ({message.reason})"
    head = f"{message.seq:8d}  {message.status}{reason}"
    if message.angles_deg is None:
        return head
    angles = message.angles_deg
    return (
        f"{head:24s}  flexion {angles.flexion:8.2f}°  abduction {angles.abduction:8.2f}°  rotation {angles.rotation:8.2f}°"
        f"  age {age_ms:5.1f} ms"
    )
