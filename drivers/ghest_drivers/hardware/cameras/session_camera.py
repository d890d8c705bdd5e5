"""What drivers on a vendor library share: a session from `open` to `close`, guarded against both being called at once."""

import logging
import threading
from abc import ABC, abstractmethod
from typing import Generic, Protocol, TypeVar

from ghest_drivers.errors import DeviceLost
from ghest_drivers.hardware.cameras.stats import CameraStats
from ghest_drivers.samples import CameraInfo, DeviceVitals, RgbdFrame

_log = logging.getLogger(__name__)
_TEMPERATURE_EVERY_NS = 2_000_000_000


class CameraSession(Protocol):
    """A running device."""

    @property
    def info(self) -> CameraInfo:
        """The camera's facts, as the device tells them."""
        ...

    def read(self, timeout_s: float) -> RgbdFrame:
        """See `RgbdCamera.read`."""
        ...

    def temperature_c(self) -> float | None:
        """Ask the device for its temperature, degrees Celsius; None where it does not tell."""
        ...

    def close(self) -> None:
        """Stop and release the device."""
        ...


Running = TypeVar("Running", bound=CameraSession)


class SessionCamera(ABC, Generic[Running]):
    """Base of the camera drivers: implements `RgbdCamera` but for starting the device.

    The vendor's code runs in this process: for live use wrap it in a `SupervisedCamera`.

    Args:
        name: The camera's name in the station file.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._session: Running | None = None
        self._lock = threading.Lock()
        self._temperature_c: float | None = None
        self._temperature_due_ns = 0
        self.stats = CameraStats()

    @property
    def info(self) -> CameraInfo:
        """See `RgbdCamera.info`."""
        return self._opened().info

    def open(self) -> None:
        """See `RgbdCamera.open`; also raises DriverError where the device lacks what the settings ask for."""
        with self._lock:
            if self._session is None:
                self._session = self._start()

    def read(self, timeout_s: float) -> RgbdFrame:
        """See `RgbdCamera.read`. Every other second it also asks for the temperature."""
        session = self._opened()
        frame = session.read(timeout_s)
        if frame.t_arrival_ns >= self._temperature_due_ns:
            self._temperature_due_ns = frame.t_arrival_ns + _TEMPERATURE_EVERY_NS
            self._temperature_c = session.temperature_c()
        return frame

    def vitals(self) -> DeviceVitals:
        """See `TellsVitals.vitals`."""
        return DeviceVitals(self.stats.refused(), self._temperature_c)

    def close(self) -> None:
        """See `RgbdCamera.close`."""
        with self._lock:
            session, self._session = self._session, None
        if session is not None:
            session.close()
            _log.info("camera %s: %s", self._name, self.stats.summary())

    @abstractmethod
    def _start(self) -> Running:
        """Start the device."""

    def _opened(self) -> Running:
        session = self._session
        if session is None:
            raise DeviceLost(f"camera {self._name} is not open")
        return session
