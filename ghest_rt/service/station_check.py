"""Everything of a station that needs no device, built once and thrown away: a mistake is told before anything is started."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.hardware.encoders.file_link import FileEncoderLink
from ghest_rt.config.camera_devices import RealsenseBagBackend
from ghest_rt.config.encoder_devices import ArmeoBackend, CanLogBackend, HardwareEncoderBackend
from ghest_rt.config.load import LoadedStation
from ghest_rt.errors import BadInputError, DeviceError
from ghest_rt.estimation.factory import make_estimator
from ghest_rt.extras import need_extra
from ghest_rt.kinematics.urdf import parse_urdf
from ghest_rt.service.devices import uses_simulation
from ghest_rt.service.encoder_device import make_encoder_link
from ghest_rt.vision.station import Method

if TYPE_CHECKING:
    from ghest_rt.security.identity import Identity


def check_station(
    station: LoadedStation, *, method: Method | None = None, publish: bool = True, listen: str | None = None, here: bool = True
) -> None:
    """Build what a station's file describes, as far as that needs no device.

    What only a device knows (is it there, which images does it make) is left to the service, a library that is not installed
    to whoever needs it.

    Args:
        station: The station.
        method: Overrides its `estimator.method`.
        publish: Whether it will publish.
        listen: Overrides its endpoints to listen on.
        here: Whether it will run on this machine: then the identity and the files that stand for devices are looked at, too.

    Raises:
        BadInputError: Two parts of the station do not fit each other, or a file it names cannot be used.
        NotPermittedError: This user may not look at the identity.
        DeviceError: A file that stands for a device is missing.
        GhestError: The extra `security` is needed and not installed.
    """
    uses_simulation(station)
    _check_depth(station, method or station.config.estimator.method)
    _check_links(station)
    config = station.config
    make_estimator(
        config,
        station.urdf_text,
        f"{config.exoskeleton.urdf} (of {station.source})",
        config.encoders.joints,
        method="refined" if method == "aruco" else method,
    )
    if isinstance(config.encoders.device, HardwareEncoderBackend):
        _check_encoders(station, here=here)
    if here:
        for key, path in _files(station):
            if not path.is_file():
                raise DeviceError(f"{station.source}: {key} = {str(path)!r}: there is no such file; correct the path")
    if publish and config.publisher.enabled and here:
        _check_publisher(station, listen)
    if config.recorder.encrypt_to:
        _check_recipients(station)


def _check_depth(station: LoadedStation, method: Method) -> None:
    without = [name for name, camera in station.config.cameras.items() if not camera.depth]
    if method == "paper" and without:
        raise BadInputError(
            f"{station.source}: method paper reads every disk's position from depth (eq. 3), and cameras.{without[0]}.depth is "
            "false; choose another method (estimator.method, --method), or give the camera its depth"
        )


def _check_links(station: LoadedStation) -> None:
    config = station.config
    links = parse_urdf(station.urdf_text, config.exoskeleton.urdf).links
    named = {"exoskeleton.base_link": config.exoskeleton.base_link}
    named |= {f"cameras.{name}.link": camera.link for name, camera in config.cameras.items()}
    if config.elbow is not None:
        named["elbow.link"] = config.elbow.link
    for key, link in named.items():
        if link not in links:
            raise BadInputError(
                f"{station.source}: {key} = {link!r} is not a link of {config.exoskeleton.urdf}; it has {', '.join(links)}"
            )


def _check_encoders(station: LoadedStation, *, here: bool) -> None:
    try:
        link = make_encoder_link(station, MonotonicClock(), paced=False)
    except DeviceNotFound:  # a library: told where the device is made, and by the doctor
        return
    if here and isinstance(link, FileEncoderLink) and all(path.is_file() for _, path in _files(station)):
        try:
            asyncio.run(_open_once(link))
        except DeviceNotFound as error:
            raise BadInputError(f"{station.source}: encoders.device: {error}; correct it, or name another file") from error


async def _open_once(link: FileEncoderLink) -> None:
    await link.open()
    await link.close()


def _files(station: LoadedStation) -> Iterator[tuple[str, Path]]:
    """Yield the files that stand for devices, by key."""
    folder = Path(station.source).parent
    for name, camera in station.config.cameras.items():
        if isinstance(camera.device, RealsenseBagBackend):
            yield f"cameras.{name}.device.path", folder / camera.device.path
    device = station.config.encoders.device
    if isinstance(device, CanLogBackend | ArmeoBackend):
        yield "encoders.device.path", folder / device.path


# What follows imports only where it is wanted: after a crash every tenth of a second counts.


def _check_publisher(station: LoadedStation, listen: str | None) -> None:
    from ghest_rt.security.session import session_settings  # noqa: PLC0415

    publisher = station.config.publisher
    try:
        identity = None if publisher.identity is None else _identity(Path(station.source).parent / publisher.identity)
        session_settings(publisher.listen if listen is None else (listen,), publisher.connect, identity)
    except BadInputError as error:
        raise type(error)(f"{station.source}: publisher: {error}") from error


def _identity(folder: Path) -> "Identity":
    need_extra("security", "a connection with TLS")
    from ghest_rt.security.identity_check import load_identity  # noqa: PLC0415  (needs the extra `security`)

    return load_identity(folder)


def _check_recipients(station: LoadedStation) -> None:
    from ghest_rt.security.sealing import check_recipients  # noqa: PLC0415

    try:
        check_recipients(station.config.recorder.encrypt_to)
    except BadInputError as error:
        raise BadInputError(f"{station.source}: recorder.encrypt_to: {error}") from error
