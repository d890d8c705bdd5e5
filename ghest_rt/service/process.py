"""Make this process punctual: no garbage collection in a tick, quick thread switches, real-time priority where permitted."""

import contextlib
import ctypes
import gc
import os
import resource
import sys
from collections.abc import Callable, Iterator

_SWITCH_INTERVAL_S = 5e-4  # a vision thread in Python code holds the loop up for at most this long
_FIFO_PRIORITY = 10
_MCL_CURRENT = 1
_MCL_FUTURE = 2
_MCL_ONFAULT = 4
_SETTLED_ROUND = 10
_FULL_EVERY = 60


class GarbageRounds:
    """Collects garbage at moments of the loop's choosing; does nothing where the interpreter collects by itself.

    Young objects every round, everything every 60th. In the tenth, when devices, pipeline and publisher stand, what has
    survived is frozen: later rounds do not walk through it again.

    Args:
        now_ns: A monotonic clock.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._rounds = 0
        self._longest_ns = 0

    @property
    def longest_ms(self) -> float:
        """The longest round so far, milliseconds; but for the one that freezes."""
        return self._longest_ns * 1e-6

    def collect(self) -> None:
        """Do a round: call it right after a tick, once a second."""
        if gc.isenabled():
            return
        self._rounds += 1
        start_ns = self._now_ns()
        if self._rounds == _SETTLED_ROUND:
            gc.collect()
            gc.freeze()
            return
        gc.collect(2 if self._rounds % _FULL_EVERY == 0 else 1)
        self._longest_ns = max(self._longest_ns, self._now_ns() - start_ns)


@contextlib.contextmanager
def punctual_process() -> Iterator[list[str]]:
    """Set the process up for pacing and put it back afterwards; yields what was achieved, one phrase each.

    Real-time priority holds for the calling thread alone: threads started later (vision, Zenoh) have ordinary priority.
    """
    achieved = []
    interval_s = sys.getswitchinterval()
    collecting = gc.isenabled()
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()
    gc.disable()
    achieved.append("garbage collection between ticks only")
    fifo = _try_fifo()
    achieved.append("SCHED_FIFO" if fifo else "ordinary priority (no permission for SCHED_FIFO)")
    locked = _try_lock_memory()
    achieved.append("memory locked" if locked else "memory not locked (no permission)")
    try:
        yield achieved
    finally:
        if locked:
            ctypes.CDLL(None).munlockall()
        if fifo:
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        gc.unfreeze()
        if collecting:
            gc.enable()
        sys.setswitchinterval(interval_s)


def _try_fifo() -> bool:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(_FIFO_PRIORITY))
    except (OSError, AttributeError):
        return False
    return True


def _try_lock_memory() -> bool:
    # Under a limit, locking future pages would make a later allocation fail: only without one.
    if resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] != resource.RLIM_INFINITY:
        return False
    # On fault: what has been touched stays. Without, every page of every library and thread stack is read in: 500 MB for 110.
    try:
        return int(ctypes.CDLL(None).mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT)) == 0
    except AttributeError:
        return False
