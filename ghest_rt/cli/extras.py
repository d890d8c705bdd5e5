"""Optional parts of the installation."""

import importlib.util

from ghest_rt.errors import GhestError

_SIMULATOR = ("mujoco", "mink", "scipy")


def need_simulation() -> None:
    """Check that the simulator is installed, before anything of it is imported.

    Raises:
        GhestError: It is not; names the extra.
    """
    missing = [name for name in _SIMULATOR if importlib.util.find_spec(name) is None]
    if missing:
        raise GhestError(f"the simulated clinic needs {', '.join(missing)}: pip install 'ghest-rt[sim]'")
