"""Between the thread that feeds a replay and the readers of one device: a queue, the time axis, and who waits for whom."""

import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceLost, EndOfStream, ReadTimeout
from ghest_drivers.replay.timeline import Timeline
from ghest_drivers.samples import EncoderSample, RgbdFrame

_S = TypeVar("_S", RgbdFrame, EncoderSample)

_LOOK_AHEAD_NS = 200_000_000
_KEEP_NS = 250_000_000  # a sample overdue by more gives way to a newer one
_SLICE_NS = 20_000_000  # how soon a waiting read notices that it was closed
FEED_WAIT_S = 0.005


class Feed:
    """What the outlets of one player share.

    Attributes:
        changed: Guards everything here and in the outlets; notified of every change.
        timeline: The time axis.
        closed: Whether the player was closed.
        ended: Whether the last event has been fed.
        error: What ended it too early, if anything.
        next_ns: Recorded arrival of the sample that the feeding thread holds back, None if it holds none.
    """

    def __init__(self, clock: Clock, speed: float) -> None:
        self.changed = threading.Condition()
        self.clock = clock
        self.timeline = Timeline(speed)
        self.closed = False
        self.ended = False
        self.error: Exception | None = None
        self.next_ns: int | None = None

    def close(self) -> None:
        """Wake everybody."""
        with self.changed:
            self.closed = True
            self.changed.notify_all()

    def end(self, error: Exception | None) -> None:
        """No more events will come."""
        with self.changed:
            self.ended, self.error, self.next_ns = True, error, None
            self.changed.notify_all()

    def now_ns(self) -> int:
        """Return the clock's time, on the axis as far as it is fixed."""
        return self.clock.now_ns() if self.timeline.fixed else 0

    def far_ahead(self, now_ns: int) -> bool:
        """Whether the sample held back need not be passed on yet."""
        return self.next_ns is not None and self.timeline.to_clock_ns(self.next_ns) > now_ns + _LOOK_AHEAD_NS


class Outlet(Generic[_S]):
    """One device's queue.

    Args:
        feed: What it shares with the player's other outlets.
        name: For messages.
        start: Called at each opening, before anything is read.
    """

    def __init__(self, feed: Feed, name: str, start: Callable[[], None]) -> None:
        self._feed = feed
        self._name = name
        self._start = start
        self._queue: deque[_S] = deque()
        self._is_open = False

    def open(self) -> None:
        """Let samples be read.

        Raises:
            DeviceNotFound: The player is closed.
        """
        self._start()
        self._is_open = True

    def close(self) -> None:
        """Wake the reader."""
        with self._feed.changed:
            self._is_open = False
            self._feed.changed.notify_all()

    def check_open(self) -> None:
        """Raise DeviceLost unless open."""
        if not self._is_open:
            raise DeviceLost(f"replay {self._name} is not open")
        if self._feed.closed:
            raise DeviceLost(f"replay {self._name}: the player was closed")

    def put(self, sample: _S) -> bool:
        """Queue a sample once it is not too far ahead of its time; False if the player was closed meanwhile."""
        feed, timeline = self._feed, self._feed.timeline
        with feed.changed:
            if timeline.first_ns is None:
                timeline.first_ns = sample.t_arrival_ns
            feed.next_ns = sample.t_arrival_ns
            while not feed.closed and feed.far_ahead(feed.now_ns()):
                feed.changed.wait(_SLICE_NS * 1e-9)
            feed.next_ns = None
            self._queue.append(sample)
            if timeline.fixed:
                oldest_ns = feed.now_ns() - _KEEP_NS
                while len(self._queue) > 1 and timeline.to_clock_ns(self._queue[0].t_arrival_ns) < oldest_ns:
                    self._queue.popleft()
            feed.changed.notify_all()
            return not feed.closed

    def poll(self, deadline_ns: int) -> _S | int | None:
        """Return the next sample if it is due, else when to look again, or None if the feeding thread is to be waited for.

        Raises:
            ReadTimeout: `deadline_ns` has come.
            DeviceLost: Closed, or the events broke off with an error.
            EndOfStream: All has been read.
        """
        feed, timeline = self._feed, self._feed.timeline
        with feed.changed:
            self.check_open()
            now_ns = feed.clock.now_ns()
            if timeline.start_ns is None and timeline.first_ns is not None:
                timeline.start_ns = now_ns
            wake_ns = min(deadline_ns, now_ns + _SLICE_NS)
            if self._queue:
                due_ns = timeline.to_clock_ns(self._queue[0].t_arrival_ns)
                if due_ns <= now_ns:
                    return timeline.moved(self._queue.popleft())
                wake_ns = min(wake_ns, due_ns)
            elif feed.ended:
                if feed.error is not None:
                    raise DeviceLost(f"replay {self._name}: the recording broke off: {feed.error}") from feed.error
                raise EndOfStream(f"replay {self._name}: the recording is through")
            if now_ns >= deadline_ns:
                raise ReadTimeout(f"replay {self._name}: no sample yet")
            if self._queue or feed.far_ahead(now_ns):
                return wake_ns
            feed.changed.notify_all()
            return None

    def wait_for_feeder(self) -> None:
        """Wait a moment for a sample to be queued."""
        with self._feed.changed:
            if not (self._queue or self._feed.ended or self._feed.closed):
                self._feed.changed.wait(FEED_WAIT_S)
