"""`ghest-rt listen`: a small subscriber, to see that samples arrive."""

import queue
import signal
import sys
import threading

import zenoh
from pydantic import ValidationError

from ghest_rt.errors import GhestError
from ghest_rt.messages.published import GhAngles
from ghest_rt.messages.results import Reason
from ghest_rt.service.zenoh_session import open_session

_POLL_S = 0.2
_HINT_AFTER_S = 3.0


def listen_to(endpoint: str, count: int | None, as_json: bool) -> None:
    """Print samples as they arrive, until `count` have come or a signal asks to stop.

    Raises:
        BadInputError: The endpoint is malformed.
        GhestError: Zenoh cannot open a session, or what arrives is not ours.
    """
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, frame: stop.set())
    arrived: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()

    def keep(sample: zenoh.Sample) -> None:
        arrived.put((str(sample.key_expr), sample.payload.to_bytes()))

    session, _ = open_session(connect=(endpoint,))
    with session, session.declare_subscriber("ghest/*/gh/angles", keep):
        received, last_seq, lost, quiet_s = 0, -1, 0, 0.0
        while not stop.is_set() and (count is None or received < count):
            try:
                key, payload = arrived.get(timeout=_POLL_S)
            except queue.Empty:
                quiet_s += _POLL_S
                if _HINT_AFTER_S <= quiet_s < _HINT_AFTER_S + _POLL_S:
                    sys.stderr.write(f"nothing arrives from {endpoint}; is a ghest-rt running there?\n")
                continue
            quiet_s = 0.0
            try:
                message = GhAngles.model_validate_json(payload)
            except ValidationError as error:
                raise GhestError(f"{key}: not a message of this version: {error}") from error
            received += 1
            if 0 <= last_seq < message.seq - 1:
                lost += message.seq - last_seq - 1
            last_seq = message.seq
            sys.stdout.write((payload.decode() if as_json else line_of(message)) + "\n")
            sys.stdout.flush()
    sys.stderr.write(f"{received} samples received, {lost} lost\n")


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
