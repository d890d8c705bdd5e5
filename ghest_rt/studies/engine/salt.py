"""A hash of the code that results depend on: after a change of it, what is cached no longer counts."""

import hashlib
import importlib.util
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import ghest_drivers.samples
import ghest_rt
from ghest_rt.config.shipped import shipped_config_dir

# Rooms and files that change what is seen of a simulated session, and those that change besides what is estimated from it.
_SEEING = (
    "config",
    "geometry",
    "messages",
    "simulation",
    "studies/observing",
    "vision",
)
_JUDGING = (
    *_SEEING,
    "estimation",
    "kinematics",
    "studies/metrics.py",
    "studies/paper_values.py",
    "studies/rivals/angle_errors.py",
    "studies/session",
    "studies/truth.py",
    "sync",
)
_OBSERVING = "ghest_rt.studies.observing"
_SEEING_LIBRARIES = ("numpy", "mujoco", "opencv-python-headless", "mink", "daqp", "scipy")
_JUDGING_LIBRARIES = (*_SEEING_LIBRARIES, "imufusion", "SALib")


@cache
def code_salt(kind: str) -> str:
    """Return the hash of the code behind tasks of a kind, of the shipped station files, and of the libraries' versions.

    The kind's code is its module and those beside it.
    What is observed does not depend on the estimators: it is kept when only they change.
    """
    module_name = kind.partition(":")[0]
    seeing = module_name.startswith(_OBSERVING)
    digest = hashlib.sha256(
        (_hash_of(_SEEING, _SEEING_LIBRARIES) if seeing else _hash_of(_JUDGING, _JUDGING_LIBRARIES)).encode()
    )
    spec = importlib.util.find_spec(module_name)
    if spec is not None and spec.origin is not None:
        for file in sorted(Path(spec.origin).parent.glob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()


@cache
def _hash_of(code: tuple[str, ...], libraries: tuple[str, ...]) -> str:
    digest = hashlib.sha256()
    for package in libraries:
        digest.update(f"{package} {_version(package)}\0".encode())
    root = Path(ghest_rt.__file__).parent
    for name in code:
        path = root / name
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(file.relative_to(root).as_posix().encode() + b"\0" + file.read_bytes())
    digest.update(Path(ghest_drivers.samples.__file__).read_bytes())
    stations = shipped_config_dir()
    for file in sorted(path for path in stations.rglob("*") if path.suffix in {".toml", ".urdf"}):
        digest.update(file.relative_to(stations).as_posix().encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"
