"""Whether a simulated world keeps up with the clock that a live run holds it to."""

import logging
import statistics
import threading
import time
from collections.abc import Callable

from ghest_drivers.samples import CameraInfo, EncoderInfo, EncoderSample, RgbdFrame
from ghest_drivers.sim import SimWorld

_log = logging.getLogger(__name__)

_WARM_UP = 3
_JUDGED = 11


class PacedWorld:
    """A world as it is, that says once when a frame takes longer to render than the camera's period; a `SimWorld`.

    Args:
        world: The world.
        now_ns: What rendering is timed by.
    """

    def __init__(self, world: SimWorld, now_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._world = world
        self._now_ns = now_ns
        self._took_ms: dict[str, list[float]] = {}
        self._lock = threading.Lock()
        self.slowness = ""  # what was said, "" while the world keeps up

    def camera_info(self, name: str) -> CameraInfo:
        """See `SimWorld.camera_info`."""
        return self._world.camera_info(name)

    def frame(self, name: str, k: int) -> RgbdFrame | None:
        """See `SimWorld.frame`."""
        begin_ns = self._now_ns()
        frame = self._world.frame(name, k)
        took_ms = self._took_ms.setdefault(name, [])
        if frame is not None and len(took_ms) < _WARM_UP + _JUDGED:
            took_ms.append((self._now_ns() - begin_ns) * 1e-6)
            if len(took_ms) == _WARM_UP + _JUDGED:
                self._judge(name, statistics.median(took_ms[_WARM_UP:]), 1e3 / frame.info.rate_hz)
        return frame

    def encoder_info(self) -> EncoderInfo:
        """See `SimWorld.encoder_info`."""
        return self._world.encoder_info()

    def encoder_sample(self, k: int) -> EncoderSample | None:
        """See `SimWorld.encoder_sample`."""
        return self._world.encoder_sample(k)

    def _judge(self, name: str, took_ms: float, period_ms: float) -> None:
        with self._lock:  # each camera has a thread of its own
            if took_ms <= period_ms or self.slowness:
                return
            self.slowness = (
                f"the simulation is slower than real time: rendering a frame of {name} takes {took_ms:.0f} ms, "
                f"and one is due every {period_ms:.0f} ms; record it (ghest-rt simulate), then replay it (ghest-rt --replay)"
            )
        _log.warning("%s", self.slowness)
