"""What every way of finding a marker offers."""

from typing import Protocol

from ghest_drivers.samples import RgbdFrame
from ghest_rt.messages.results import MarkerObservation


class MarkerDetector(Protocol):
    """Finds one marker in the frames of one camera. It may remember the last frames: one instance per camera, one thread."""

    def detect(self, frame: RgbdFrame) -> MarkerObservation:
        """Return the marker's pose in the colour camera frame, or why there is none.

        Raises:
            BadInputError: The images are not those of the camera that the detector was made for.
        """
        ...

    def reset(self) -> None:
        """Forget what earlier frames taught."""
        ...
