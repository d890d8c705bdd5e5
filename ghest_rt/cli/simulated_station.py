"""A station file of the user's own, before it is simulated.

The simulation reads the URDF with MuJoCo, which takes much that the service refuses: document types, limits that are swapped.
What makes the truth shares no code with what is judged by it, so the two readings meet here.
"""

from pathlib import Path

from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.kinematics.forward import ForwardKinematics


def checked_station(path: Path) -> LoadedStation:
    """Return a station file whose URDF the service could use as well.

    Raises:
        BadInputError: The file or its URDF cannot be used; names place and remedy.
    """
    station = load_station(path)
    config = station.config
    ForwardKinematics(
        station.urdf_text,
        f"{config.exoskeleton.urdf} (of {station.source})",
        base_link=config.exoskeleton.base_link,
        links=[camera.link for camera in config.cameras.values()],
        settings_m=config.exoskeleton.settings_m,
        measured_joints=config.encoders.joints,
    )
    return station
