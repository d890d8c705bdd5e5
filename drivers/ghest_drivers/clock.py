"""Clocks. All host times are `int` nanoseconds of one monotonic clock; the clock is an argument, never a global."""

import asyncio
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol


class Clock(Protocol):
    """Host monotonic time, and a blocking wait on it."""

    def now_ns(self) -> int:
        """Return the present time in nanoseconds."""
        ...

    def sleep_until_ns(self, t_ns: int) -> None:
        """Block the calling thread until `t_ns`; return at once if that has passed."""
        ...


class MonotonicClock:
    """The host's CLOCK_MONOTONIC."""

    def now_ns(self) -> int:
        """Return CLOCK_MONOTONIC in nanoseconds."""
        return time.monotonic_ns()

    def sleep_until_ns(self, t_ns: int) -> None:
        """Sleep until `t_ns`."""
        delay_ns = t_ns - time.monotonic_ns()
        if delay_ns > 0:
            time.sleep(delay_ns * 1e-9)


class VirtualClock:
    """A clock that jumps to whatever is waited for: tests and off-line runs own their time."""

    def __init__(self, start_ns: int = 0) -> None:
        self._now_ns = start_ns

    def now_ns(self) -> int:
        """Return the virtual time in nanoseconds."""
        return self._now_ns

    def sleep_until_ns(self, t_ns: int) -> None:
        """Jump to `t_ns`, never backwards."""
        self._now_ns = max(self._now_ns, t_ns)


class AsyncSleeper:
    """Waits on any clock without holding up the event loop, on a thread of its own."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._pool: ThreadPoolExecutor | None = None

    async def sleep_until_ns(self, t_ns: int) -> None:
        """Wait until the clock shows `t_ns`; a cancelled wait keeps the thread busy until then."""
        if self._pool is None:
            self._pool = ThreadPoolExecutor(1, thread_name_prefix="sleeper")
        await asyncio.get_running_loop().run_in_executor(self._pool, self._clock.sleep_until_ns, t_ns)

    def close(self) -> None:
        """Let the thread end; harmless if done before."""
        if self._pool is not None:
            self._pool.shutdown(wait=False)
            self._pool = None
