"""From a receiving thread to the event loop."""

import asyncio
import contextlib
import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from ghest_drivers.hardware.encoders.stats import LinkStats, Rejection

_ITEMS = 8192
Item = TypeVar("Item")


class Handoff(Generic[Item]):
    """Carries items from a thread to the event loop, bounded: when the loop is stuck, the oldest are dropped and counted.

    Args:
        loop: The event loop.
        receive: Called on the loop with everything handed over since its last call.
        stats: Where dropped items are counted.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, receive: Callable[[deque[Item]], None], stats: LinkStats) -> None:
        self._loop = loop
        self._receive = receive
        self._stats = stats
        self._lock = threading.Lock()
        self._items: deque[Item] = deque(maxlen=_ITEMS)
        self._called = False

    def put(self, item: Item) -> None:
        """Hand over one item; from any thread."""
        with self._lock:
            if len(self._items) == _ITEMS:
                self._stats.rejected[Rejection.OVERRUN] += 1
            self._items.append(item)
            call = not self._called
            self._called = True
        if call:
            self.call(self._drain)

    def call(self, function: Callable[[], None]) -> None:
        """Have `function` called on the loop, after what was put before; harmless once the loop is closed."""
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(function)

    def _drain(self) -> None:
        with self._lock:
            items, self._items = self._items, deque(maxlen=_ITEMS)
            self._called = False
        self._receive(items)
