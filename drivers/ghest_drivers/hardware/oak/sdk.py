"""The vendor library, or an error that says how to get it."""

import os
from typing import TYPE_CHECKING

from ghest_drivers.errors import DeviceNotFound
from ghest_drivers.installing import pip_install

# It writes its warnings to standard output, where they would spoil what a command prints there.
os.environ.setdefault("DEPTHAI_LEVEL", "error")

if TYPE_CHECKING:
    import depthai as dai
else:
    try:
        import depthai as dai
    except ModuleNotFoundError as error:
        raise DeviceNotFound(f"the library for OAK cameras is missing: {pip_install('oak')}") from error
    except ImportError as error:
        raise DeviceNotFound(f"depthai cannot be loaded: {error}") from error

__all__ = ["dai"]
