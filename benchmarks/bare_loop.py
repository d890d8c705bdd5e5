"""The yardstick of the loop benchmark: `clock_nanosleep` to absolute deadlines and nothing else, in a process of its own.

Prints one JSON list: how late each wake-up was, microseconds.
"""

import ctypes
import json
import sys
import time

_CLOCK_MONOTONIC = 1
_TIMER_ABSTIME = 1


class _Timespec(ctypes.Structure):
    _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))


def main(seconds: float, rate_hz: float) -> None:
    """Wake at t_0 + k / rate for the time asked for."""
    libc = ctypes.CDLL(None, use_errno=True)
    late_us = []
    start_ns = time.monotonic_ns() + 10_000_000
    for k in range(int(seconds * rate_hz)):
        deadline_ns = start_ns + round(k * 1e9 / rate_hz)
        spec = _Timespec(*divmod(deadline_ns, 1_000_000_000))
        libc.clock_nanosleep(_CLOCK_MONOTONIC, _TIMER_ABSTIME, ctypes.byref(spec), None)
        late_us.append((time.monotonic_ns() - deadline_ns) / 1e3)
    json.dump(late_us, sys.stdout)


if __name__ == "__main__":
    main(float(sys.argv[1]), float(sys.argv[2]))
