"""What systemd does with the unit: readiness, watchdog, abort, restart, with its own times; on a real notification socket."""

import contextlib
import os
import re
import signal
import subprocess
import threading
import time
from pathlib import Path
from typing import IO, Self

from tests.systemd.manager_socket import ManagerSocket

UNIT = Path(__file__).parents[2] / "systemd" / "ghest-rt.service"
_POLL_S = 0.01
_UNITS_S = {"ms": 1e-3, "s": 1.0, "": 1.0}


def unit_seconds(key: str) -> float:
    """Return a time span that the unit file sets."""
    match = re.search(rf"^{key}=(\d+)(ms|s|)$", UNIT.read_text(), flags=re.MULTILINE)
    assert match is not None, f"{UNIT.name} does not set {key}"
    return int(match[1]) * _UNITS_S[match[2]]


class Manager:
    """Keeps a service running as `Restart=always` does; stands where a rig expects a process.

    Attributes:
        ends: Why earlier processes ended: "watchdog", or an exit code, and when (CLOCK_MONOTONIC, ns).
    """

    def __init__(self, command: list[str], environment: dict[str, str], cwd: Path, folder: Path, output: IO[str]) -> None:
        self.ends: list[tuple[int, str]] = []
        self._watchdog_s = unit_seconds("WatchdogSec")
        self._restart_s = unit_seconds("RestartSec")
        self._abort_s = unit_seconds("TimeoutAbortSec")
        path = folder / "notify"
        path.unlink(missing_ok=True)
        self._socket = ManagerSocket(path)
        self._command, self._cwd, self._output = command, cwd, output
        self._environment = {
            **environment,
            "NOTIFY_SOCKET": str(path),
            "WATCHDOG_USEC": str(round(self._watchdog_s * 1e6)),
            "PYTHONFAULTHANDLER": "1",
        }
        self._stopping = threading.Event()
        self._process = self._start()
        self._thread = threading.Thread(target=self._run, name="manager", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self._thread.join()
        if self._process.poll() is None:
            self._signal(signal.SIGCONT)
            self._process.terminate()
            try:
                self._process.wait(10)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._socket.__exit__()

    @property
    def pid(self) -> int:
        """Of the process that runs now."""
        return self._process.pid

    def poll(self) -> int | None:
        """None, as a process that runs: there always is one, or will be."""
        return None

    def children(self) -> list[int]:
        """Return the process ids of its camera processes."""
        found: list[int] = []
        for task in Path(f"/proc/{self.pid}/task").glob("*/children"):
            found += [int(child) for child in task.read_text().split()]
        return [pid for pid in found if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]

    def _start(self) -> "subprocess.Popen[str]":
        self._socket.drain()
        return subprocess.Popen(
            self._command, cwd=self._cwd, env=self._environment, stdout=self._output, stderr=self._output, text=True
        )

    def _run(self) -> None:
        ready, fed_s = False, time.monotonic()
        while not self._stopping.is_set():
            for text in self._socket.drain():
                lines = text.split("\n")
                ready = ready or "READY=1" in lines
                if "WATCHDOG=1" in lines or "READY=1" in lines:
                    fed_s = time.monotonic()
            code = self._process.poll()
            if code is None and ready and time.monotonic() - fed_s > self._watchdog_s:
                self._abort()
                self._restart("watchdog")
                ready = False
            elif code is not None:
                self._restart(f"exit code {code}")
                ready = False
            self._stopping.wait(_POLL_S)

    def _abort(self) -> None:
        """SIGABRT, and SIGCONT so that a stopped process gets it; SIGKILL if that does not help."""
        self._signal(signal.SIGABRT)
        self._signal(signal.SIGCONT)
        try:
            self._process.wait(self._abort_s)
        except subprocess.TimeoutExpired:
            self._signal(signal.SIGKILL)
            self._process.wait()

    def _restart(self, why: str) -> None:
        self.ends.append((time.monotonic_ns(), why))
        if not self._stopping.wait(self._restart_s):
            self._process = self._start()

    def _signal(self, number: signal.Signals) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process.pid, number)
