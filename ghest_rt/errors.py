"""Errors a user can mend; the CLI prints their text and exits with their code.

GhestError (1)
├── BadInputError (2)     config, URDF, recording, motion file: names the place and the remedy
│   └── NotPermittedError file or folder that this user may not look at
└── DeviceError (3)       a device that is missing or lost
"""

from typing import ClassVar


class GhestError(Exception):
    """Root of the errors with a message meant for the user."""

    exit_code: ClassVar[int] = 1


class BadInputError(GhestError):
    """A file or value given by the user cannot be used; the text says where and what to do."""

    exit_code: ClassVar[int] = 2


class NotPermittedError(BadInputError):
    """This user may not look at a file, so that nothing can be said of it: another user's service may be able to use it."""


class DeviceError(GhestError):
    """A device is missing or was lost for good."""

    exit_code: ClassVar[int] = 3
