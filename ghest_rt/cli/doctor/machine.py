"""The machine and the installation: Python, extras, permissions, the network port."""

import importlib.metadata
import os
import platform
import resource
import socket
import sys
from collections.abc import Iterable, Iterator

from ghest_drivers.installing import pip_install
from ghest_rt import __version__
from ghest_rt.cli.doctor.findings import Finding, missing, note, ok
from ghest_rt.extras import MODULES_OF_EXTRA, missing_modules

_FIFO_PRIORITY = 10
EXTRA_OF_BACKEND = {
    "sim": "sim",
    "realsense": "realsense",
    "realsense_bag": "realsense",
    "oak": "oak",
    "serial": "serial",
    "can": "can",
    "can_log": "can",
    "canopen": "can",
}
_DEVICE_EXTRAS = {"realsense", "oak", "serial", "can"}


def check_machine() -> Iterator[Finding]:
    """Say what machine this is."""
    yield ok("ghest-rt", f"{__version__} on Python {platform.python_version()}")
    system = f"{platform.system()} {platform.release()}, {platform.machine()}, {os.cpu_count()} cores"
    if sys.platform != "linux":
        yield note("machine", system, "only Linux is tested")
    elif (os.cpu_count() or 1) < 2:
        yield note("machine", system, "two cameras at 60 Hz need two cores")
    else:
        yield ok("machine", system)


def check_extras(needed: Iterable[str]) -> Iterator[Finding]:
    """Say which optional parts are installed; those of `needed` must be."""
    for extra, modules in MODULES_OF_EXTRA.items():
        absent = missing_modules(extra)
        check = f"extra {extra}"
        if not absent:
            yield ok(check, ", ".join(f"{name} {_version(name)}" for name in modules))
        elif extra in needed:
            exit_code = 3 if extra in _DEVICE_EXTRAS else 1
            yield missing(check, f"not installed: {', '.join(absent)}", pip_install(extra), exit_code)
        else:
            yield note(check, "not installed", f"{pip_install(extra)}, if it is wanted")


def _version(module: str) -> str:
    names = importlib.metadata.packages_distributions().get(module)
    return importlib.metadata.version(names[0]) if names else "installed"


def check_real_time() -> Iterator[Finding]:
    """Say whether the service may be punctual."""
    remedy = "run it as the systemd unit does (LimitRTPRIO=20, LimitMEMLOCK=infinity), or see limits.conf(5)"
    limit = f"rtprio limit {resource.getrlimit(resource.RLIMIT_RTPRIO)[0]}"
    if _may_be_real_time():
        yield ok("real-time priority", f"permitted ({limit})")
    else:
        yield note("real-time priority", f"not permitted ({limit}): samples leave up to some milliseconds later", remedy)
    memlock = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0]
    if memlock == resource.RLIM_INFINITY:
        yield ok("locked memory", "permitted, unlimited")
    else:
        yield note("locked memory", f"not permitted (memlock limit {memlock // 1024} kB; it must be unlimited)", remedy)


def _may_be_real_time() -> bool:
    before = os.sched_getscheduler(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(_FIFO_PRIORITY))
    except OSError:
        return False
    os.sched_setscheduler(0, before & ~os.SCHED_RESET_ON_FORK, os.sched_param(0))
    return True


def check_endpoints(endpoints: Iterable[str]) -> Iterator[Finding]:
    """Say whether Zenoh can listen where it shall."""
    for endpoint in endpoints:
        check = f"Zenoh on {endpoint}"
        protocol, _, rest = endpoint.partition("/")
        host, _, port = rest.partition("#")[0].partition("?")[0].rpartition(":")
        if protocol not in ("tcp", "tls") or not port.isdigit():
            yield note(check, "cannot be looked at from here")
            continue
        try:
            with socket.create_server((host.strip("[]"), int(port)), family=_family(host)):
                yield ok(check, "free")
        except OSError as error:
            remedy = "is another ghest-rt running? Stop it, or choose another endpoint with --listen or publisher.listen"
            yield missing(check, f"cannot be listened on: {error.strerror or error}", remedy, exit_code=1)


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if host.startswith("[") else socket.AF_INET
