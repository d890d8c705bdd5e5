"""The gateway beside the stations of a machine: its unit and its identity (docs/security.md)."""

from collections.abc import Sequence
from pathlib import Path

from ghest_rt.cli.gateway import DEFAULT_STATION
from ghest_rt.config.load import load_station
from ghest_rt.errors import BadInputError
from ghest_rt.security.access import ACCESS_FILE
from ghest_rt.security.endpoints import split_endpoint, stays_here
from ghest_rt.security.files import read_small
from ghest_rt.security.identity import CA_FILE, CERTIFICATE_FILE, KEY_FILE, use_identity
from ghest_rt.security.roles import SERVER_ROLES

GATEWAY_UNIT = "ghest-rt-gateway.service"
IDENTITY_DIR = "etc/ghest-rt/gateway"
KEY_PATH = f"{IDENTITY_DIR}/{KEY_FILE}"


def identity_files(folder: Path) -> dict[str, bytes]:
    """Return the files of a gateway's identity, checked, by path under the root.

    Raises:
        BadInputError: It cannot be used, or is nobody's whom others may connect to.
        GhestError: The extra `security` is not installed.
    """
    identity = use_identity(folder)
    if identity.role not in SERVER_ROLES:
        raise BadInputError(f"--gateway {folder}: the identity of a {identity.role}; issue one with --role router")
    names = (CA_FILE, CERTIFICATE_FILE, KEY_FILE, ACCESS_FILE)
    return {f"{IDENTITY_DIR}/{name}": read_small(folder / name, "identity") for name in names}


def gateway_unit(template: str, stations: Sequence[Path]) -> bytes:
    """Return the unit of a gateway to stations, by their station files.

    Raises:
        BadInputError: None of them listens where the gateway could reach it.
    """
    listening = (load_station(path).config.publisher for path in stations)
    found = dict.fromkeys(
        endpoint
        for publisher in listening
        for endpoint in (publisher.listen if publisher.enabled else ())
        if split_endpoint(endpoint)[0] == "tcp" and stays_here(endpoint)
    )
    if not found:
        raise BadInputError(f"--gateway: no station listens on this machine: [publisher] listen = [{DEFAULT_STATION!r}]")
    return template.replace(f"--station {DEFAULT_STATION}", " ".join(f"--station {endpoint}" for endpoint in found)).encode()
