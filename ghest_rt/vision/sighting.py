"""What `refined` knows of one frame when it has its pose, for whoever can do better with it."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ghest_rt.vision.disk_centers import DiskCenters
from ghest_rt.vision.ellipses import MarkerImage
from ghest_rt.vision.plate_light import PlateLight
from ghest_rt.vision.plate_plane import Plane
from ghest_rt.vision.pose_fit import PoseFit


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """One marker in one frame.

    Attributes:
        image: (H, W, 3) colour image.
        predicted: The disks as foretold; their shapes are good enough to find their edges.
        measured: The disks p0..p3; None where one is not wholly seen.
        light: The light on the plate.
        plane: The plate's plane in the colour camera at the colour image's time; None where depth takes no part.
        fit: The pose found.
        reach_px: By how much a better pose may move an edge.
    """

    image: NDArray[np.uint8]
    predicted: MarkerImage
    measured: DiskCenters
    light: PlateLight
    plane: Plane | None
    fit: PoseFit
    reach_px: float


class Polish(Protocol):
    """Improves a pose."""

    def __call__(self, sighting: Sighting) -> PoseFit | None:
        """Return a better fit, or None to keep the one that there is."""
        ...

    def reset(self) -> None:
        """Forget what earlier frames taught."""
        ...
