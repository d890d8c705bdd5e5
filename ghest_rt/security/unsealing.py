"""Open sealed recordings again (needs the extra `security`)."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import pyrage

from ghest_rt.errors import BadInputError
from ghest_rt.security.files import check_secret, read_small
from ghest_rt.security.sealing import SEALED_MAGIC

Identities = list[pyrage.x25519.Identity]


@dataclass(frozen=True, slots=True)
class Unsealed:
    """What came of a file.

    Attributes:
        path: The restored file.
        size_bytes: Its size.
        whole: False if the sealed file was cut off or changed: then this is what came before.
    """

    path: Path
    size_bytes: int
    whole: bool


def load_keys(path: Path) -> Identities:
    """Read secret keys, one a line; lines with # are comments.

    Raises:
        BadInputError: The file is missing, readable by others, or holds none. Never shows what is in it.
    """
    lines = read_small(path, "secret key").decode(errors="replace").splitlines()
    keys = [line.strip() for line in lines if line.strip() and not line.startswith("#")]
    try:
        found = [pyrage.x25519.Identity.from_str(key) for key in keys]
    except pyrage.IdentityError:
        found = []
    if not found:
        raise BadInputError(f"{path}: holds no secret key (AGE-SECRET-KEY-1…); take the file that ghest-rt recording-key wrote")
    check_secret(path)
    return found


def unseal(sealed: Path, out: Path, keys: Identities, progress: Callable[[int], None]) -> Unsealed:
    """Restore a sealed file.

    Args:
        sealed: The file.
        out: Where to; must not exist. Readable by its owner alone.
        keys: Secret keys; one must fit.
        progress: Told how many bytes have been restored, now and then.

    Raises:
        BadInputError: It is not sealed, not for these keys, or nothing in it is whole; `out` exists or cannot be written.
    """
    try:
        with sealed.open("rb") as file:
            if file.read(len(SEALED_MAGIC)) != SEALED_MAGIC:
                raise BadInputError(f"{sealed}: is not sealed; it can be used as it is")
            file.seek(0)
            fd = os.open(out, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with os.fdopen(fd, "wb") as plain:
                target = _Counted(plain, progress)
                whole = _decrypt(file, target, keys, sealed)
    except FileExistsError as error:
        raise BadInputError(f"{out} exists already; name another folder with --out") from error
    except OSError as error:
        raise BadInputError(f"{error.filename or sealed}: {error.strerror or error}") from error
    if not whole and not target.size_bytes:
        out.unlink()
        raise BadInputError(f"{sealed}: {_NOT_OURS}")
    return Unsealed(out, target.size_bytes, whole)


_NOT_OURS = "cannot be opened: sealed for another key than the one given, or damaged at its beginning"


class _Counted:
    """Passes bytes on and counts them."""

    def __init__(self, file: BinaryIO, progress: Callable[[int], None]) -> None:
        self.size_bytes = 0
        self.failure: OSError | None = None
        self._file = file
        self._progress = progress

    def write(self, data: bytes) -> int:
        try:
            self._file.write(data)
        except OSError as error:
            self.failure = error
            raise
        self.size_bytes += len(data)
        self._progress(self.size_bytes)
        return len(data)

    def flush(self) -> None:
        self._file.flush()


def _decrypt(file: BinaryIO, target: _Counted, keys: Identities, sealed: Path) -> bool:
    """Return whether all of it was whole; the library tells a bad piece by the same exceptions as a full disk."""
    try:
        pyrage.decrypt_io(file, target, keys)
    except (pyrage.DecryptError, OSError, ValueError) as error:
        if target.failure is not None:
            raise target.failure from error
        return False
    return True
