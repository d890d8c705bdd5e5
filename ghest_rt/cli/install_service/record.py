"""What has been installed: `installed.json` beside the station files, so that it can be undone."""

import hashlib
from pathlib import Path

from pydantic import BaseModel, ConfigDict, ValidationError

from ghest_rt.errors import BadInputError

RECORD = Path("etc/ghest-rt/installed.json")


class InstalledService(BaseModel):
    """One unit.

    Attributes:
        files: SHA-256 of every file written for it, by path under the root.
        station: Its station file, by path under the root; None for the gateway.
    """

    model_config = ConfigDict(extra="forbid")
    files: dict[str, str]
    station: str | None = None


class Installed(BaseModel):
    """Every service of this machine, by unit."""

    model_config = ConfigDict(extra="forbid")
    services: dict[str, InstalledService] = {}

    def known_sha256(self, path: str) -> set[str]:
        """Return what was written to a path."""
        return {service.files[path] for service in self.services.values() if path in service.files}

    def shared(self, path: str, unit: str) -> bool:
        """Return whether a unit other than this one needs the file."""
        return any(path in service.files for name, service in self.services.items() if name != unit)


def read_record(root: Path) -> Installed:
    """Read the record; empty if nothing has been installed.

    Raises:
        BadInputError: It is not readable, or damaged.
    """
    path = root / RECORD
    try:
        return Installed.model_validate_json(path.read_bytes()) if path.exists() else Installed()
    except OSError as error:
        raise BadInputError(f"{path}: {error.strerror or error}; run it as root: sudo ghest-rt install-service …") from error
    except ValidationError as error:
        raise BadInputError(f"{path}: damaged; remove it and the files of ghest-rt by hand (docs/systemd.md)") from error


def sha256(data: bytes) -> str:
    """Return the digest by which files are recognised."""
    return hashlib.sha256(data).hexdigest()
