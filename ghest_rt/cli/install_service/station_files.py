"""The files of a station that the service needs beside its station file."""

import contextlib
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from ghest_rt.config.load import LoadedStation, load_station
from ghest_rt.config.station import StationConfig
from ghest_rt.errors import BadInputError, NotPermittedError
from ghest_rt.service.station_check import check_station

STATION_FILE = "station.toml"


def station_files(path: Path, *, here: bool) -> tuple[StationConfig, dict[str, bytes]]:
    """Return a station with the files it consists of, by path relative to its folder.

    Args:
        path: The station file.
        here: Whether it will run on this machine.

    Raises:
        BadInputError: The station file is invalid, is one of a replay, or names files that cannot be taken along.
        GhestError: The service would refuse it.
    """
    station = load_station(path)
    config = station.config
    files = {STATION_FILE: station.toml_text.encode()}
    named = [("exoskeleton.urdf", config.exoskeleton.urdf)]
    devices = {f"cameras.{name}.device": camera.device for name, camera in config.cameras.items()}
    for key, device in {**devices, "encoders.device": config.encoders.device}.items():
        if device.backend == "replay":
            raise BadInputError(f"{path}: {key}.backend is replay; a service runs on devices")
        named.extend((f"{key}.{field}", str(getattr(device, field))) for field in ("dbc", "path") if hasattr(device, field))
    identity = config.publisher.identity
    if identity is not None and not PurePosixPath(identity).is_absolute():
        raise BadInputError(
            f"{path}: publisher.identity = {identity!r}: a private key is not copied along; give the folder's absolute path "
            "(docs/systemd.md, Network), or leave it out and install a gateway: --gateway FOLDER"
        )
    for key, name in named:
        relative = PurePosixPath(name)
        if relative.is_absolute():
            continue
        if ".." in relative.parts or str(relative) == STATION_FILE:
            raise BadInputError(f"{path}: {key} = {name!r}: put the file beside the station file, or give its absolute path")
        try:
            files[str(relative)] = (path.parent / relative).read_bytes()
        except OSError as error:
            raise BadInputError(f"{path}: {key}: cannot read {path.parent / relative}: {error.strerror or error}") from error
    accept(station, here=here)
    return config, files


def accept(station: LoadedStation, *, here: bool) -> None:
    """Refuse a station that the service would refuse.

    What this user may not look at is left to the installation itself, which root does, and to the service's user.

    Args:
        station: The station.
        here: Whether it will run on this machine.

    Raises:
        GhestError: The service would refuse it (`check_station`).
    """
    with contextlib.suppress(NotPermittedError):
        check_station(station, here=here)


def clash(config: StationConfig, others: Sequence[tuple[str, Path]]) -> None:
    """Refuse a station that another service of this machine would get in the way of.

    Args:
        config: The new station.
        others: Units and station files of the others.

    Raises:
        BadInputError: Two stations have the same id or listen on the same endpoint.
    """
    for unit, path in others:
        other = load_station(path).config
        if other.station.id == config.station.id:
            raise BadInputError(f"station.id {config.station.id!r} is that of {unit}: give this station another")
        both = set(other.publisher.listen) & set(config.publisher.listen)
        if both and other.publisher.enabled and config.publisher.enabled:
            raise BadInputError(
                f"{unit} listens on {', '.join(sorted(both))} already: give this station another port, "
                '[publisher] listen = ["tcp/127.0.0.1:7448"]'
            )


def leaves_machine(config: StationConfig) -> list[str]:
    """Return the endpoints that are not on loopback, which the unit does not let through."""
    local = ("/127.", "/localhost:", "/[::1]:")
    endpoints = (*config.publisher.listen, *config.publisher.connect)
    return [
        endpoint
        for endpoint in endpoints
        if config.publisher.enabled and not endpoint.startswith("unixsock") and not any(part in endpoint for part in local)
    ]
