"""The optional part `security` of the installation: certificates and sealed recordings."""

import importlib.util

from ghest_rt.errors import GhestError

_LIBRARIES = ("cryptography", "pyrage")


def need_security() -> None:
    """Check that the libraries are installed, before anything that uses them is imported.

    Raises:
        GhestError: They are not; names the extra.
    """
    missing = [name for name in _LIBRARIES if importlib.util.find_spec(name) is None]
    if missing:
        raise GhestError(f"certificates and sealed recordings need {', '.join(missing)}: pip install 'ghest-rt[security]'")
