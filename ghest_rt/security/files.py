"""Reading and writing the files of identities: small, whole, and readable by nobody else where they are secret."""

import os
import stat
from pathlib import Path

from ghest_rt.errors import BadInputError, NotPermittedError

_MAX_BYTES = 1_000_000
SECRET_MODE = 0o600
PUBLIC_MODE = 0o644


def read_small(path: Path, what: str) -> bytes:
    """Return a file's bytes.

    Raises:
        BadInputError: It cannot be read (NotPermittedError: by this user), or is larger than anything of its kind.
    """
    try:
        with path.open("rb") as file:
            data = file.read(_MAX_BYTES + 1)
    except OSError as error:
        raise _unreadable(error)(f"{path}: cannot read the {what}: {error.strerror or error}") from error
    if len(data) > _MAX_BYTES:
        raise BadInputError(f"{path}: the {what} is larger than {_MAX_BYTES} bytes; is it the right file?")
    return data


def write_whole(path: Path, data: bytes, mode: int) -> None:
    """Write a file so that it is there whole or not at all, and never with more rights than `mode`.

    Raises:
        BadInputError: It cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        fd = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        try:
            with os.fdopen(fd, "wb") as file:
                os.fchmod(file.fileno(), mode)
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise BadInputError(f"{path}: cannot write: {error.strerror or error}") from error


def make_folder(path: Path, mode: int) -> None:
    """Make a folder (and those above it) if it is not there.

    Raises:
        BadInputError: It cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True, mode=mode)
    except OSError as error:
        raise BadInputError(f"{path}: cannot make this folder: {error.strerror or error}") from error


def check_secret(path: Path) -> None:
    """Refuse a private key that others can read or change.

    A file of root's may be readable by its group: so the administrator lends it to a service that runs as another user
    (systemd's credentials look the same).

    Raises:
        BadInputError: Too many may read it; says how to mend it.
    """
    try:
        facts = path.stat()
    except OSError as error:
        raise _unreadable(error)(f"{path}: cannot read the private key: {error.strerror or error}") from error
    mode = stat.S_IMODE(facts.st_mode)
    lent = stat.S_IRGRP if facts.st_uid == 0 else 0
    if mode & 0o077 & ~lent:
        raise BadInputError(
            f"{path}: others on this machine can read or change this private key (mode {mode:04o}): chmod 600 {path}"
        )


def _unreadable(error: OSError) -> type[BadInputError]:
    return NotPermittedError if isinstance(error, PermissionError) else BadInputError
