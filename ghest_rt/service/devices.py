"""The devices that a station file names, through the driver layer's factory."""

from collections.abc import Mapping
from pathlib import Path

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DriverError
from ghest_drivers.factory import make_camera, make_encoders
from ghest_drivers.interfaces import EncoderLink, RgbdCamera
from ghest_rt.config.camera_devices import RealsenseBagBackend
from ghest_rt.config.devices import SimBackend
from ghest_rt.config.load import LoadedStation
from ghest_rt.config.station import Camera
from ghest_rt.errors import BadInputError, DeviceError
from ghest_rt.service.encoder_device import make_encoder_link


def uses_simulation(station: LoadedStation) -> bool:
    """Return whether the station's devices are simulated.

    Raises:
        BadInputError: Some are and some are not.
    """
    config = station.config
    cameras = {f"cameras.{name}": camera.device for name, camera in config.cameras.items()}
    devices = {**cameras, "encoders": config.encoders.device}
    simulated = [isinstance(device, SimBackend) for device in devices.values()]
    if any(simulated) and not all(simulated):
        backends = ", ".join(f"{key} is {device.backend}" for key, device in devices.items())
        raise BadInputError(
            f'{station.source}: either all devices of a station are simulated (backend = "sim") or none, and {backends}; '
            "correct the backends"
        )
    return all(simulated)


def make_devices(
    station: LoadedStation, clock: Clock, sim_settings: Mapping[str, object]
) -> tuple[dict[str, RgbdCamera], EncoderLink]:
    """Make the station's cameras by name, and its encoder link; none is open yet.

    Args:
        station: The station.
        clock: Host clock.
        sim_settings: What simulated devices are made with: `world` and `start_ns`.

    Raises:
        BadInputError: A setting of a device does not fit the others.
        DeviceError: A backend is unknown here, or the library that drives it is missing.
    """
    config = station.config
    try:
        cameras = {name: _camera(name, camera, station, clock, sim_settings) for name, camera in config.cameras.items()}
        if isinstance(config.encoders.device, SimBackend):
            return cameras, make_encoders("sim", clock, sim_settings)
        return cameras, make_encoder_link(station, clock)
    except DriverError as error:
        raise DeviceError(str(error)) from error


def _camera(name: str, camera: Camera, station: LoadedStation, clock: Clock, sim_settings: Mapping[str, object]) -> RgbdCamera:
    device = camera.device
    if isinstance(device, SimBackend):
        return make_camera("sim", name, clock, sim_settings)
    settings = device.model_dump(exclude={"backend"}) | {"depth": camera.depth}
    if isinstance(device, RealsenseBagBackend):
        settings["path"] = str(Path(station.source).parent / device.path)
    return make_camera(device.backend, name, clock, settings)
