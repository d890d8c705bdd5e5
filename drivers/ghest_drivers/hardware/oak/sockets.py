"""Which of a device's sensors give colour and which the stereo pair."""

from collections.abc import Iterable
from dataclasses import dataclass

from ghest_drivers.errors import DriverError
from ghest_drivers.hardware.oak.sdk import dai


@dataclass(frozen=True, slots=True)
class Sockets:
    """Board sockets by their use."""

    color: "dai.CameraBoardSocket"
    left: "dai.CameraBoardSocket"
    right: "dai.CameraBoardSocket"


def choose_sockets(features: Iterable["dai.CameraFeatures"]) -> Sockets:
    """Take colour from the middle camera where there is one (OAK-D), from the left one otherwise (OAK-D SR).

    Raises:
        DriverError: There is no stereo pair, or nothing with colour.
    """
    sockets = dai.CameraBoardSocket
    colored = {feature.socket: dai.CameraSensorType.COLOR in feature.supportedTypes for feature in features}
    if sockets.CAM_B not in colored or sockets.CAM_C not in colored:
        found = ", ".join(sorted(socket.name for socket in colored)) or "none"
        raise DriverError(f"this OAK has no stereo pair on CAM_B and CAM_C (cameras found: {found})")
    for socket in (sockets.CAM_A, sockets.CAM_B):
        if colored.get(socket):
            return Sockets(socket, sockets.CAM_B, sockets.CAM_C)
    raise DriverError("neither the middle nor the left camera of this OAK sees colours: use an OAK-D or an OAK-D SR")
