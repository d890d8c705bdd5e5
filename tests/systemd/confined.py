"""Run `ghest-rt` under the unit's system call filter, address families and W^X, without systemd: libseccomp and prctl.

python confined.py UNIT [ARGUMENTS of ghest-rt…]; with the argument `probe`, tells what the confinement refuses.
"""

import ctypes
import importlib
import importlib.util
import json
import mmap
import multiprocessing.shared_memory
import os
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

EPERM = 1
ACT_EPERM = 0x00050000 | EPERM
ACT_ALLOW = 0x7FFF0000
CMP_EQ = 4
PR_SET_MDWE = 65


class ArgumentTest(ctypes.Structure):
    _fields_ = (("arg", ctypes.c_uint), ("op", ctypes.c_int), ("a", ctypes.c_uint64), ("b", ctypes.c_uint64))


def values(unit: Path, key: str) -> list[str]:
    return [
        word for line in unit.read_text().splitlines() if line.startswith(f"{key}=") for word in line.split("=", 1)[1].split()
    ]


def members(group: str) -> set[str]:
    shown = subprocess.run(["systemd-analyze", "syscall-filter", group], capture_output=True, text=True, check=True).stdout
    words = [line.strip() for line in shown.splitlines()[1:] if line.strip() and not line.strip().startswith("#")]
    return {name for word in words for name in (members(word) if word.startswith("@") else {word})}


def allowed_calls(unit: Path) -> set[str]:
    allowed: set[str] = set()
    for word in values(unit, "SystemCallFilter"):
        group = word.removeprefix("~")
        calls = members(group) if group.startswith("@") else {group}
        allowed = allowed - calls if word.startswith("~") else allowed | calls
    return allowed


def confine(unit: Path) -> None:
    seccomp = ctypes.CDLL("libseccomp.so.2")
    seccomp.seccomp_init.restype = ctypes.c_void_p
    context = ctypes.c_void_p(seccomp.seccomp_init(ACT_EPERM))
    calls = allowed_calls(unit)
    for name in sorted(calls - {"socket"}):
        number = seccomp.seccomp_syscall_resolve_name(name.encode())
        if number >= 0:
            seccomp.seccomp_rule_add_array(context, ACT_ALLOW, number, 0, None)
    for family in values(unit, "RestrictAddressFamilies"):
        test = ArgumentTest(0, CMP_EQ, getattr(socket, family), 0)
        number = seccomp.seccomp_syscall_resolve_name(b"socket")
        seccomp.seccomp_rule_add_array(context, ACT_ALLOW, number, 1, ctypes.byref(test))
    if seccomp.seccomp_load(context) != 0:
        raise OSError("the filter was not taken")
    if "yes" in values(unit, "MemoryDenyWriteExecute"):
        ctypes.CDLL(None).prctl(PR_SET_MDWE, 1, 0, 0, 0)  # Linux 6.3; older ones go without


def shared_memory() -> None:
    memory = multiprocessing.shared_memory.SharedMemory(create=True, size=1 << 20)
    memory.close()
    memory.unlink()


def library(name: str) -> Callable[[], object]:
    return lambda: importlib.import_module(name)


def probe() -> None:
    attempts: dict[str, Callable[[], object]] = {
        "chroot": lambda: os.chroot("/"),
        "packet": lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW),
        "w^x": lambda: mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC),
        "loopback": lambda: socket.create_server(("127.0.0.1", 0)).close(),
        "netlink": lambda: socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 15).close(),
        "scheduling": lambda: os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0)),
        "process": lambda: subprocess.run(["true"], check=True),
        "shared memory": shared_memory,
        **{name: library(name) for name in ("serial", "can", "canopen", "depthai") if importlib.util.find_spec(name)},
    }
    if importlib.util.find_spec("pyrealsense2"):  # no wheel beyond Python 3.11
        attempts["pyrealsense2"] = lambda: importlib.import_module("pyrealsense2").context().query_devices()
    answers = {}
    for name, attempt in attempts.items():
        try:
            attempt()
            answers[name] = "done"
        except OSError as error:
            answers[name] = f"refused {error.errno}"
    sys.stdout.write(json.dumps(answers) + "\n")


if __name__ == "__main__":
    confine(Path(sys.argv[1]))
    if sys.argv[2] == "probe":
        probe()
    else:
        sys.argv = ["ghest-rt", *sys.argv[2:]]
        from ghest_rt.cli.main import main

        main()
