"""Wake the event loop at an absolute instant of CLOCK_MONOTONIC: a kernel timer where there is one."""

import asyncio
import ctypes
import os
import sys
import time
from collections.abc import Callable
from typing import Protocol

_TFD_TIMER_ABSTIME = 1
_NS_PER_S = 1_000_000_000


class Alarm(Protocol):
    """Calls back once at the instant set last."""

    def arm(self, t_monotonic_ns: int) -> None:
        """Set the instant; one that has passed fires at once."""
        ...

    def close(self) -> None:
        """Never fire again; release what is held."""
        ...


class _Timespec(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


class _Itimerspec(ctypes.Structure):
    _fields_ = (("interval", _Timespec), ("value", _Timespec))


class TimerfdAlarm:
    """A timerfd on CLOCK_MONOTONIC, watched by the event loop: some 100 µs late, against 800 µs of asyncio's own timers."""

    def __init__(self, loop: asyncio.AbstractEventLoop, callback: Callable[[], None]) -> None:
        self._loop = loop
        self._callback = callback
        self._fd = _timerfd_create()
        loop.add_reader(self._fd, self._fired)

    def arm(self, t_monotonic_ns: int) -> None:
        """Set the instant; one that has passed fires at once."""
        _timerfd_set(self._fd, max(t_monotonic_ns, 1))

    def close(self) -> None:
        """Never fire again; close the file descriptor."""
        if self._fd >= 0:
            self._loop.remove_reader(self._fd)
            os.close(self._fd)
            self._fd = -1

    def _fired(self) -> None:
        try:
            os.read(self._fd, 8)
        except BlockingIOError:  # re-armed between the kernel's wake-up and this call
            return
        self._callback()


class LoopAlarm:
    """The event loop's own timer, for platforms without timerfd."""

    def __init__(self, loop: asyncio.AbstractEventLoop, callback: Callable[[], None]) -> None:
        self._loop = loop
        self._callback = callback
        self._handle: asyncio.TimerHandle | None = None

    def arm(self, t_monotonic_ns: int) -> None:
        """Set the instant; one that has passed fires at once."""
        self._cancel()
        delay_s = (t_monotonic_ns - time.monotonic_ns()) / _NS_PER_S
        self._handle = self._loop.call_later(max(delay_s, 0.0), self._callback)

    def close(self) -> None:
        """Never fire again."""
        self._cancel()

    def _cancel(self) -> None:
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None


def make_alarm(loop: asyncio.AbstractEventLoop, callback: Callable[[], None]) -> Alarm:
    """Return the best alarm this platform has."""
    try:
        return TimerfdAlarm(loop, callback)
    except (OSError, AttributeError, NotImplementedError):
        return LoopAlarm(loop, callback)


if sys.version_info >= (3, 13):

    def _timerfd_create() -> int:
        return os.timerfd_create(time.CLOCK_MONOTONIC, flags=os.TFD_NONBLOCK | os.TFD_CLOEXEC)

    def _timerfd_set(fd: int, t_ns: int) -> None:
        os.timerfd_settime_ns(fd, flags=os.TFD_TIMER_ABSTIME, initial=t_ns)

else:
    _libc = ctypes.CDLL(None, use_errno=True)

    def _timerfd_create() -> int:
        fd = int(_libc.timerfd_create(time.CLOCK_MONOTONIC, os.O_NONBLOCK | os.O_CLOEXEC))
        if fd < 0:
            raise OSError(ctypes.get_errno(), "timerfd_create")
        return fd

    def _timerfd_set(fd: int, t_ns: int) -> None:
        spec = _Itimerspec(_Timespec(0, 0), _Timespec(*divmod(t_ns, _NS_PER_S)))
        if _libc.timerfd_settime(fd, _TFD_TIMER_ABSTIME, ctypes.byref(spec), None) != 0:
            raise OSError(ctypes.get_errno(), "timerfd_settime")
