"""What the service's process and a camera's process tell each other over a pipe. All of it is pickled."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from ghest_drivers import errors
from ghest_drivers.hardware.supervisor.ring import RingLayout
from ghest_drivers.samples import CameraInfo


@dataclass(frozen=True, slots=True)
class BackendSpec:
    """Which camera to make in the other process.

    Attributes:
        module: Dotted path of the module.
        maker: The callable in it, called with `name`, `clock` and the settings.
        settings: Its keyword arguments; they are pickled.
    """

    module: str
    maker: str
    settings: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Opened:
    """Camera to service: streaming."""

    info: CameraInfo


@dataclass(frozen=True, slots=True)
class Attach:
    """Service to camera: write frames here."""

    ring_name: str
    layout: RingLayout


@dataclass(frozen=True, slots=True)
class Problem:
    """Camera to service: an error of the driver.

    Attributes:
        kind: The error class's name.
        message: Its text.
    """

    kind: str
    message: str

    @classmethod
    def of(cls, error: Exception) -> "Problem":
        """Describe an error."""
        return cls(type(error).__name__, str(error) or type(error).__name__)

    def error(self) -> errors.DriverError:
        """Return it as an error of this process; what is no driver error becomes DeviceLost."""
        known = getattr(errors, self.kind, None)
        if isinstance(known, type) and issubclass(known, errors.DriverError):
            return known(self.message)
        return errors.DeviceLost(f"{self.kind}: {self.message}")


@dataclass(frozen=True, slots=True)
class Stop:
    """Service to camera: close and end."""
