"""Messages out on Zenoh: keys, encoding, liveliness, and what can be asked for.

| key under `ghest/<station>/` | what |
|---|---|
| `gh/angles` | every sample, `GhAngles` |
| `health` | once a second, `Health` |
| `events` | when something happens, `Event` |
| `alive` | liveliness token |
| `schema`, `config`, `calibration`, `last` | queryables, JSON |
| `gh/recent?run_id=…;first=…;last=…` | queryable: the samples of half a minute, by sequence number |
"""

import json
import logging
from types import TracebackType
from typing import Any, Self

import zenoh

from ghest_rt.config.station import StationConfig
from ghest_rt.messages.published import Event, GhAngles, Health, json_schemas
from ghest_rt.messages.results import GhEstimate
from ghest_rt.service.recent import RecentSamples

_log = logging.getLogger(__name__)

ANGLES_KEY = "gh/angles"
HEALTH_KEY = "health"
EVENTS_KEY = "events"
RECENT_KEY = "gh/recent"
ALIVE_KEY = "alive"


class ZenohPublisher:
    """Publishes one station's messages on an open session; close it before the session.

    Without `lossless`, a subscriber that does not read is not waited for: Zenoh drops messages for it once its queues are full,
    so that it cannot hold up the tick (sequence numbers show it). With it, publishing waits instead: for runs without a clock.
    """

    def __init__(self, session: zenoh.Session, config: StationConfig, lossless: bool = False) -> None:
        prefix = f"ghest/{config.station.id}"
        congestion = zenoh.CongestionControl.BLOCK if lossless else zenoh.CongestionControl.DROP
        self._recent = RecentSamples()
        self._failed = 0
        self._publishers = {
            key: session.declare_publisher(
                f"{prefix}/{key}", encoding=zenoh.Encoding.APPLICATION_JSON, congestion_control=congestion
            )
            for key in (ANGLES_KEY, HEALTH_KEY, EVENTS_KEY)
        }
        documents = {
            "schema": json.dumps(json_schemas()),
            "config": config.model_dump_json(),
            "calibration": config.calibration.model_dump_json(),
        }
        self._queryables = [self._answer(session, f"{prefix}/{key}", text.encode()) for key, text in documents.items()]
        self._last_key = f"{prefix}/last"
        self._queryables.append(session.declare_queryable(self._last_key, self._answer_last))
        self._recent_key = f"{prefix}/{RECENT_KEY}"
        self._queryables.append(session.declare_queryable(self._recent_key, self._answer_recent))
        # Last: whoever sees the token may ask for everything else.
        self._token = session.liveliness().declare_token(f"{prefix}/{ALIVE_KEY}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Withdraw the keys and the token."""
        declared: list[Any] = [self._token, *self._queryables, *self._publishers.values()]
        for item in declared:
            item.undeclare()

    def angles(self, message: GhAngles, estimate: GhEstimate) -> None:
        """Publish a sample and keep it for those who ask for it later."""
        payload = message.model_dump_json().encode()
        self._recent.add(message.run_id, message.seq, payload)
        self._put(ANGLES_KEY, payload)

    def health(self, message: Health) -> None:
        """Publish the service's state."""
        self._put(HEALTH_KEY, message.model_dump_json().encode())

    def event(self, message: Event) -> None:
        """Publish an event."""
        self._put(EVENTS_KEY, message.model_dump_json().encode())

    def _put(self, key: str, payload: bytes) -> None:
        try:
            self._publishers[key].put(payload)
        except zenoh.ZError:
            self._failed += 1
            if self._failed == 1:
                _log.exception("Zenoh refused a message; more are not reported")

    @staticmethod
    def _answer(session: zenoh.Session, key: str, payload: bytes) -> "zenoh.Queryable[None]":
        def reply(query: zenoh.Query) -> None:
            query.reply(key, payload, encoding=zenoh.Encoding.APPLICATION_JSON)

        return session.declare_queryable(key, reply)

    def _answer_last(self, query: zenoh.Query) -> None:
        """Called on a thread of Zenoh's."""
        payload = self._recent.newest
        if payload is None:
            query.reply_err(b'"no sample has been published yet"', encoding=zenoh.Encoding.APPLICATION_JSON)
        else:
            query.reply(self._last_key, payload, encoding=zenoh.Encoding.APPLICATION_JSON)

    def _answer_recent(self, query: zenoh.Query) -> None:
        """Called on a thread of Zenoh's."""
        given = query.parameters
        run_id, first, last = (given.get(name) or "" for name in ("run_id", "first", "last"))
        if run_id and _is_seq(first) and _is_seq(last):
            payload = self._recent.page(run_id, int(first), int(last))
            query.reply(self._recent_key, payload, encoding=zenoh.Encoding.APPLICATION_JSON)
        else:
            query.reply_err(b'"ask with ?run_id=ID;first=SEQ;last=SEQ"', encoding=zenoh.Encoding.APPLICATION_JSON)


def _is_seq(text: str) -> bool:
    return text.isascii() and text.isdigit() and len(text) < 19
