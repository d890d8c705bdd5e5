"""Updates on their way to one receiver: bounded, so that a slow receiver costs itself samples and nobody else anything."""

import asyncio
import contextlib
import logging
import threading
from collections import deque
from collections.abc import Callable
from types import TracebackType
from typing import Self

from ghest_rt.client.updates import Gap, GapCause, LinkChanged, Sample, Update

_log = logging.getLogger(__name__)

CAPACITY = 2048  # half a minute at 66.6 Hz


class Updates:
    """The updates of a client, for one receiver: an asynchronous iterator, or `get` for programs without asyncio.

    Who does not take them in time loses the oldest, and is told which samples by a `Gap`.
    """

    def __init__(self, capacity: int) -> None:
        if capacity < 1:
            raise ValueError("capacity must be at least 1")
        self._capacity = capacity
        self._changed = threading.Condition()
        self._waiting: deque[Update] = deque()
        self._overrun: dict[tuple[str, str], Gap] = {}
        self._dropped_links: dict[str, LinkChanged] = {}
        self._closed = False
        self._wake: tuple[asyncio.AbstractEventLoop, asyncio.Event] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Take no more; what has come can still be read."""
        with self._changed:
            self._closed = True
            self._notify()

    def put(self, update: Update) -> bool:
        """Add an update (called by the client) without waiting for the receiver; return whether it still takes any."""
        with self._changed:
            if self._closed:
                return False
            if len(self._waiting) >= self._capacity:
                self._drop(self._waiting.popleft())
            self._waiting.append(update)
            self._notify()
            return True

    def get(self, timeout_s: float | None = None) -> Update | None:
        """Return the next update, waiting for it; None when time is up or nothing more comes."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._any(), timeout_s)
            return self._next()

    @property
    def closed(self) -> bool:
        """Whether nothing more comes and everything was taken."""
        with self._changed:
            return self._closed and not self._any()

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> Update:
        while True:
            with self._changed:
                update = self._next()
                if update is not None:
                    return update
                if self._closed:
                    raise StopAsyncIteration
                arrived = asyncio.Event()
                self._wake = (asyncio.get_running_loop(), arrived)
            await arrived.wait()

    def _any(self) -> bool:
        return bool(self._waiting or self._overrun or self._dropped_links)

    def _next(self) -> Update | None:
        # What was dropped is older than all that waits.
        if self._overrun:
            return self._overrun.pop(next(iter(self._overrun)))
        if self._dropped_links:
            return self._dropped_links.pop(next(iter(self._dropped_links)))
        return self._waiting.popleft() if self._waiting else None

    def _drop(self, update: Update) -> None:
        if isinstance(update, Sample):
            message = update.message
            self._merge(Gap(update.station, message.run_id, message.seq, message.seq, GapCause.OVERRUN))
        elif isinstance(update, Gap):
            self._merge(Gap(update.station, update.run_id, update.first_seq, update.last_seq, GapCause.OVERRUN))
        elif isinstance(update, LinkChanged):
            self._dropped_links[update.station] = update

    def _merge(self, gap: Gap) -> None:
        key = (gap.station, gap.run_id)
        first_seq = self._overrun[key].first_seq if key in self._overrun else gap.first_seq
        self._overrun[key] = Gap(gap.station, gap.run_id, first_seq, gap.last_seq, GapCause.OVERRUN)

    def _notify(self) -> None:
        self._changed.notify_all()
        if self._wake is not None:
            loop, arrived = self._wake
            self._wake = None
            with contextlib.suppress(RuntimeError):  # the loop was closed
                loop.call_soon_threadsafe(arrived.set)


class CallbackThread:
    """Calls a function with every update, on a thread of its own: if it blocks, only itself gets less."""

    def __init__(self, updates: Updates, callback: Callable[[Update], None]) -> None:
        self._updates = updates
        self._callback = callback
        self._thread = threading.Thread(target=self._run, name="ghest-client-callback", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Call no more."""
        self._updates.close()

    def _run(self) -> None:
        while (update := self._updates.get()) is not None:
            try:
                self._callback(update)
            except Exception:
                _log.exception("a callback for updates failed; it gets the next one all the same")
