"""Optional parts of the installation: what belongs to each, and one message where it is missing."""

import importlib.util

from ghest_drivers.installing import pip_install
from ghest_rt.errors import GhestError

_SIM = ("mujoco", "mink", "scipy")

MODULES_OF_EXTRA = {
    "sim": _SIM,
    "parquet": ("pyarrow",),
    "plots": ("matplotlib",),
    "study": (*_SIM, "pyarrow", "matplotlib", "joblib", "SALib", "jinja2", "imufusion"),
    "cluster": ("distributed",),
    "rt": ("uvloop",),
    "metrics": ("prometheus_client",),
    "security": ("cryptography", "pyrage"),
    "realsense": ("pyrealsense2",),
    "oak": ("depthai",),
    "serial": ("serial",),
    "can": ("can", "cantools", "canopen"),
}
"""Modules that come with each extra of pyproject.toml."""


def missing_modules(extra: str) -> list[str]:
    """Return the modules of an extra that are not installed."""
    return [name for name in MODULES_OF_EXTRA[extra] if importlib.util.find_spec(name) is None]


def need_extra(extra: str, what: str) -> None:
    """Check that an extra is installed, before anything of it is imported.

    Devices have their own check, `ghest_drivers.factory`: there a missing library is a missing device (exit code 3).

    Args:
        extra: Its name in pyproject.toml.
        what: The thing that needs it, to begin the message with.

    Raises:
        GhestError: Something of it is missing; names the extra.
    """
    missing = missing_modules(extra)
    if missing:
        raise GhestError(f"{what} needs {', '.join(missing)}: {pip_install(extra)}")
