"""`SupervisedCamera`: any camera backend in a process of its own, under a watchdog."""

import logging
import threading
from collections import Counter
from dataclasses import dataclass

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DeviceLost
from ghest_drivers.hardware.supervisor.link import ChildLink, Limits
from ghest_drivers.hardware.supervisor.protocol import BackendSpec
from ghest_drivers.samples import CameraInfo, DeviceVitals, RgbdFrame

_log = logging.getLogger(__name__)


@dataclass(slots=True)
class SupervisorStats:
    """Counters since the camera object was made.

    Attributes:
        started: Processes started.
        lost: Of these, how many crashed, hung or lost their device.
        overwritten: Frames that the reader was too slow for.
    """

    started: int = 0
    lost: int = 0
    overwritten: int = 0


class SupervisedCamera:
    """An `RgbdCamera` whose vendor code runs in a child process.

    A crash, a hang or silence of the child becomes DeviceLost at the next `read`; the child is then killed. Opening again
    starts a new one, which resets the hardware first where the backend can.

    Args:
        name: The camera's name in the station file.
        spec: The backend to run.
        clock: Host clock; the child uses CLOCK_MONOTONIC, which is the same for all processes.
        limits: How long to wait for what.
    """

    def __init__(self, name: str, spec: BackendSpec, clock: Clock, limits: Limits | None = None) -> None:
        self._name = name
        self._spec = spec
        self._clock = clock
        self._limits = limits or Limits()
        self._link: ChildLink | None = None
        self._lock = threading.Lock()
        self._abort = threading.Event()
        self._reset_next = False
        self._refused_before: Counter[str] = Counter()
        self.stats = SupervisorStats()

    @property
    def info(self) -> CameraInfo:
        """See `RgbdCamera.info`."""
        return self._opened().info

    @property
    def pid(self) -> int:
        """The child's process id.

        Raises:
            DeviceLost: The camera is not open.
        """
        return self._opened().pid

    def vitals(self) -> DeviceVitals:
        """See `TellsVitals.vitals`: what the child said last, and what its predecessors had refused."""
        link = self._link
        newest = DeviceVitals() if link is None else link.vitals
        refused = self._refused_before + Counter(newest.refused)
        refused["overwritten"] += self.stats.overwritten
        refused["processes_lost"] += self.stats.lost
        return DeviceVitals(refused, newest.temperature_c)

    def open(self) -> None:
        """See `RgbdCamera.open`.

        Raises:
            DeviceLost: The child crashed or did not open the camera in time, or `close` was called meanwhile.
            DriverError: What the backend's own `open` raised.
        """
        with self._lock:
            if self._link is not None:
                return
            self._abort.clear()
            self.stats.started += 1
            reset, self._reset_next = self._reset_next, False
            try:
                self._link = ChildLink(self._name, self._spec, self._clock, self._limits, abort=self._abort, reset=reset)
            except DeviceLost:
                self._note_loss()
                raise
            _log.info("camera %s: open in process %d", self._name, self._link.pid)

    def read(self, timeout_s: float) -> RgbdFrame:
        """See `RgbdCamera.read`."""
        try:
            return self._opened().read(timeout_s)
        except DeviceLost:
            if self._link is not None:
                self._note_loss()
            raise

    def close(self) -> None:
        """See `RgbdCamera.close`. Returns when the child has ended, also if another thread closes at the same time."""
        self._abort.set()
        with self._lock:
            link, self._link = self._link, None
            if link is not None:
                link.close()
                self._refused_before.update(link.vitals.refused)
                self.stats.overwritten += link.overwritten

    def _note_loss(self) -> None:
        self.stats.lost += 1
        self._reset_next = True

    def _opened(self) -> ChildLink:
        link = self._link
        if link is None:
            raise DeviceLost(f"camera {self._name} is not open")
        return link
