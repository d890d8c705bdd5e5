"""The service under what stands for systemd, its devices' far ends, and a subscriber; directly, or through a Zenoh router."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.chaos.manager import Manager
from tests.chaos.wall_clock import WallClock
from tests.endpoints import free_endpoint
from tests.hil.injection import FILE, Window
from tests.hil.rig import ROOT, Rig, Subscriber, far_ends, service_command
from tests.hil.scene import read_scene, write_scene
from tests.hil.service import HANGS

RIG = "realsense-serial"
_START_S = 90.0

_ROUTER = """
import sys, time
from ghest_rt.security.session import open_session
session, _ = open_session(listen=(sys.argv[1],), mode="router")
print("ready", flush=True)
time.sleep(1e6)
"""


class Router:
    """A Zenoh router in a process of its own."""

    def __init__(self) -> None:
        self.endpoint = free_endpoint()
        self._process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _ROUTER, self.endpoint], cwd=ROOT, stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"

    def kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


class ChaosRig(Rig):
    """A rig whose service is restarted when it ends or hangs, with handles for what can be done to it.

    Attributes:
        manager: Stands for systemd.
        talker_pid: The process that sends encoder samples.
        folder: Of everything the fixtures share.
        endpoint: Where subscribers connect.
        router: Between service and subscriber; None if there is none.
        wall_clock: Of the service; None if it has the machine's.
    """

    def __init__(
        self,
        manager: Manager,
        subscriber: Subscriber,
        folder: Path,
        *,
        talker_pid: int,
        endpoint: str,
        router: Router | None,
        wall_clock: WallClock | None,
    ) -> None:
        super().__init__(RIG, manager, subscriber, folder, read_scene(folder))  # type: ignore[arg-type]
        self.manager = manager
        self.talker_pid = talker_pid
        self.folder = folder
        self.endpoint = endpoint
        self.router = router
        self.wall_clock = wall_clock


@contextmanager
def chaos_rig(folder: Path, *, record: bool = False, routed: bool = False, own_wall_clock: bool = False) -> Iterator[ChaosRig]:
    """Run the service; with a recorder, behind a router, or with a wall clock that can be turned."""
    if not (folder / "scene.npz").exists():
        write_scene(folder, time.monotonic_ns())
    (folder / FILE).unlink(missing_ok=True)
    recordings = folder / "recordings" if record else None
    with contextlib.ExitStack() as stack:
        station, environment, talker_pid = stack.enter_context(far_ends(RIG, folder))
        environment[HANGS] = "1"
        wall_clock = None
        if own_wall_clock:
            wall_clock = WallClock(folder)
            environment |= wall_clock.environment
        listen = endpoint = free_endpoint()
        router = Router() if routed else None
        if router is not None:
            router.start()
            stack.callback(router.kill)
            endpoint = router.endpoint
            station.write_text(station.read_text() + f'\n[publisher]\nconnect = ["{endpoint}"]\n')
        output = stack.enter_context((folder / f"{RIG}.log").open("w"))
        command = [*service_command(station, recordings), "--listen", listen]
        manager = stack.enter_context(Manager(command, environment, ROOT, folder, output))
        subscriber = Subscriber(endpoint, mode="peer" if router is None else "client")
        stack.callback(subscriber.close)
        rig = ChaosRig(
            manager, subscriber, folder, talker_pid=talker_pid, endpoint=endpoint, router=router, wall_clock=wall_clock
        )
        if not rig.wait_valid(20, _START_S):
            raise RuntimeError(f"no valid angles within {_START_S:g} s:\n{rig.log()[-3000:]}")
        yield rig


@contextmanager
def held(pid: int) -> Iterator[None]:
    """A process that is stopped meanwhile."""
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)


def window_from_now(seconds: float) -> Window:
    """Return the window of something that begins now."""
    now_ns = time.monotonic_ns()
    return Window((), "", now_ns, now_ns + round(seconds * 1e9))
