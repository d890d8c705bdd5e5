"""Seals standard input for the public keys given, onto standard output: `python -m ghest_rt.security.seal_process AGE1…`.

Started by `SealedFile`. Ends with its input and at nothing else: a signal to the service's group must not cut a recording off.
"""

import os
import signal
import sys

import pyrage

_READ_BYTES = 1 << 20
_NICE = 5


class _Output:
    """Standard output; if it takes no more (disk full), the process ends with the error's number as its exit code."""

    def write(self, data: bytes) -> int:
        left = memoryview(data)
        while left:
            try:
                left = left[os.write(1, left) :]
            except OSError as error:
                os._exit(error.errno or 1)
        return len(data)

    def flush(self) -> None:
        pass


def main() -> None:
    """Seal until the input ends."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    os.nice(_NICE)
    recipients = [pyrage.x25519.Recipient.from_str(key) for key in sys.argv[1:]]
    with open(0, "rb", buffering=_READ_BYTES) as plain:
        pyrage.encrypt_io(plain, _Output(), recipients)


if __name__ == "__main__":
    main()
