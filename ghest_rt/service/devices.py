"""The devices that a station file names, through the driver layer's factory."""

from collections.abc import Mapping

from ghest_drivers.clock import Clock
from ghest_drivers.errors import DriverError
from ghest_drivers.factory import make_camera, make_encoders
from ghest_drivers.interfaces import EncoderLink, RgbdCamera
from ghest_rt.config.load import LoadedStation
from ghest_rt.config.station import StationConfig
from ghest_rt.errors import DeviceError
from ghest_rt.service.encoder_device import make_encoder_link

SIM = "sim"


def uses_simulation(config: StationConfig) -> bool:
    """Return whether any of the station's devices is simulated."""
    return SIM in {config.encoders.device.backend, *(camera.device.backend for camera in config.cameras.values())}


def make_devices(
    station: LoadedStation, clock: Clock, sim_settings: Mapping[str, object]
) -> tuple[dict[str, RgbdCamera], EncoderLink]:
    """Make the station's cameras by name, and its encoder link; none is open yet.

    Args:
        station: The station.
        clock: Host clock.
        sim_settings: What simulated devices are made with: `world` and `start_ns`.

    Raises:
        DeviceError: A backend is unknown here, or the library that drives it is missing.
        BadInputError: The encoders' settings do not fit together, or a file they name cannot be read.
    """
    config = station.config

    def settings(device: object, own: dict[str, object]) -> dict[str, object]:
        return dict(sim_settings) if device == SIM else own

    try:
        cameras = {
            name: make_camera(
                camera.device.backend,
                name,
                clock,
                settings(camera.device.backend, camera.device.model_dump(exclude={"backend"})),
            )
            for name, camera in config.cameras.items()
        }
        if config.encoders.device.backend == SIM:
            link = make_encoders(SIM, clock, dict(sim_settings))
        else:
            link = make_encoder_link(station, clock)
    except DriverError as error:
        raise DeviceError(str(error)) from error
    return cameras, link
