"""Recordings sealed for a public key (age, https://age-encryption.org/v1) while they are written.

What is recorded goes through a pipe to a process of its own that seals it in pieces of 64 KiB: nothing is ever on the disk in
plain, sealing takes no time from the service's interpreter, and if the service is killed the other process sees the end of
its input and finishes the file. Only a power failure cuts a file off; `unseal` then restores every whole piece.
"""

import contextlib
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from ghest_rt.errors import BadInputError
from ghest_rt.extras import need_extra

SEALED_SUFFIX = ".age"
SEALED_MAGIC = b"age-encryption.org/v1"

_PIPE_BYTES = 1 << 20
_FINISH_S = 10.0


def check_recipients(keys: Sequence[str]) -> None:
    """Refuse public keys that nothing can be sealed for.

    Raises:
        BadInputError: One is malformed, or a secret one.
        GhestError: The extra `security` is not installed.
    """
    need_extra("security", "a sealed recording")
    import pyrage  # noqa: PLC0415  (needs the extra `security`)

    for key in keys:
        if key.upper().startswith("AGE-SECRET-KEY"):
            raise BadInputError(
                "--encrypt-to: this is a secret key; give the public one (age1…), and keep this one off the station"
            )
        try:
            pyrage.x25519.Recipient.from_str(key)
        except pyrage.RecipientError as error:
            raise BadInputError(f"{key!r}: not a public key (age1…): {error}; ghest-rt recording-key makes a pair") from error


class SealedFile:
    """A file for writing that seals what it is given. Not thread-safe.

    Args:
        path: The file; replaced if it exists.
        recipients: Public keys; the holder of any one's secret key can open it.

    Raises:
        OSError: From any method: the disk is full or gone, or sealing has ended before its time.
    """

    def __init__(self, path: Path, recipients: Sequence[str]) -> None:
        self._path = path
        self._file = path.open("wb")
        self._plain_bytes = 0
        try:
            self._process = subprocess.Popen(  # noqa: S603  (our own module; the keys have been checked)
                [sys.executable, "-m", "ghest_rt.security.seal_process", *recipients],
                stdin=subprocess.PIPE,
                stdout=self._file,
                pipesize=_PIPE_BYTES,
            )
        except OSError:
            self._file.close()
            raise
        if self._process.stdin is None:
            raise OSError("sealing has no input")
        self._pipe = self._process.stdin

    @property
    def closed(self) -> bool:
        """Whether `close` has been called."""
        return self._file.closed

    def write(self, data: bytes | bytearray | memoryview) -> int:
        """Take bytes; waits while sealing is behind."""
        try:
            count = self._pipe.write(data)
        except BrokenPipeError as error:
            raise self._failed(self._finish()) from error
        self._plain_bytes += count
        return count

    def flush(self) -> None:
        """Hand over to the sealing process what is still held here."""
        try:
            self._pipe.flush()
        except BrokenPipeError as error:
            raise self._failed(self._finish()) from error

    def tell(self) -> int:
        """Return how many bytes have been taken; the file is about 0.03 % longer."""
        return self._plain_bytes

    def fileno(self) -> int:
        """Return the descriptor of the sealed file, for whoever syncs it."""
        return self._file.fileno()

    def close(self) -> None:
        """Seal the rest and close; harmless if done before."""
        if self._file.closed:
            return
        try:
            with contextlib.suppress(BrokenPipeError):  # the exit code says more
                self._pipe.close()
            code = self._finish()
        finally:
            self._file.close()
        if code:
            raise self._failed(code)

    def _finish(self) -> int:
        try:
            return self._process.wait(_FINISH_S)
        except subprocess.TimeoutExpired as error:
            raise OSError(f"the disk did not take the last sealed data within {_FINISH_S:g} s") from error

    @staticmethod
    def _failed(code: int) -> OSError:
        """The sealing process's exit code is the number of the error that ended it."""
        return OSError(code, f"{os.strerror(code)}, told by the sealing process") if code > 0 else OSError("sealing was ended")


def make_recording_key(path: Path) -> str:
    """Write a new secret key to a file and return the public one.

    Raises:
        BadInputError: The file exists, or cannot be written.
        GhestError: The extra `security` is not installed.
    """
    need_extra("security", "a sealed recording")
    import pyrage  # noqa: PLC0415  (needs the extra `security`)

    identity = pyrage.x25519.Identity.generate()
    public = str(identity.to_public())
    try:
        fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError as error:
        raise BadInputError(f"{path} exists: what was sealed for the key in it would be lost; name another file") from error
    except OSError as error:
        raise BadInputError(f"{path}: cannot write: {error.strerror or error}") from error
    with os.fdopen(fd, "w") as file:
        file.write(f"# public key: {public}\n{identity}\n")
    return public
