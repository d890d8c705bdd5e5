"""What is done to a running service, beside what its devices do: to processes, clocks, processors, memory, disk, network."""

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from tests.chaos.rig import ChaosRig, held, window_from_now
from tests.hil.faults import Fault, Seen, judge
from tests.hil.injection import Window
from tests.hil.rig import ROOT, wait_until

RECOVERY_MS = 3000.0  # what is promised

Inflict = Callable[[ChaosRig], Window]


@dataclass(frozen=True, slots=True)
class Chaos:
    """Something that happens to the whole service.

    Attributes:
        name: As in the table.
        inflict: Does it, waits until it is over and says when it was; a process that does not come back by itself counts as
            over at the moment of its end.
        rig: What `chaos_rig` is asked for.
        seen_through: Whether the subscriber shall not notice at all.
    """

    name: str
    inflict: Inflict
    rig: str = "plain"
    seen_through: bool = False


def measure(rig: ChaosRig, chaos: Chaos) -> Seen:
    """Let it happen to a rig that is well, and wait until it is well again.

    Raises:
        RuntimeError: It is not well to begin with.
    """
    if not rig.wait_valid(40, 20.0):
        raise RuntimeError(f"not well before {chaos.name}:\n{rig.log()[-3000:]}")
    window = chaos.inflict(rig)
    seconds = round((window.until_ns - window.from_ns) * 1e-9, 1)
    return judge(rig, Fault(chaos.name, (), "", frozenset(), seconds), window)


def _during(seconds: float, *contexts: object) -> Window:
    window = window_from_now(seconds)
    with ExitStack() as stack:
        for context in contexts:
            stack.enter_context(context)  # type: ignore[arg-type]
        time.sleep(seconds)
    return Window((), "", window.from_ns, time.monotonic_ns())


def _stopped(seconds: float) -> Inflict:
    return lambda rig: _during(seconds, held(rig.manager.pid))


def _killed(rig: ChaosRig) -> Window:
    window = window_from_now(0.0)
    os.kill(rig.manager.pid, signal.SIGKILL)
    return window


def _hung(rig: ChaosRig) -> Window:
    """Hang the loop within a tick. It does not end by itself: the time until it is noticed belongs to the recovery."""
    known = len(rig.manager.ends)
    window = rig.inject(("service",), "hang", 0.5)
    wait_until(lambda: len(rig.manager.ends) > known, 10.0)
    return Window((), "", window.from_ns, window.from_ns)


def _camera_stopped(rig: ChaosRig) -> Window:
    return _during(1.5, held(rig.manager.children()[0]))


def _camera_killed(rig: ChaosRig) -> Window:
    window = window_from_now(0.0)
    os.kill(rig.manager.children()[0], signal.SIGKILL)
    return window


def _encoder_box_stopped(rig: ChaosRig) -> Window:
    """It sends what it has missed in one burst afterwards, as a gateway does that was out of reach."""
    return _during(1.5, held(rig.talker_pid))


@contextmanager
def _busy_processors(per_core: int) -> Iterator[None]:
    code = "while True: pass"
    count = per_core * (os.cpu_count() or 1)
    busy = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def _starved(rig: ChaosRig) -> Window:
    return _during(3.0, _busy_processors(4))


@contextmanager
def _limited(pid: int, what: int, soft: int) -> Iterator[None]:
    before = resource.prlimit(pid, what)
    resource.prlimit(pid, what, (soft, before[1]))
    try:
        yield
    finally:
        with suppress(ProcessLookupError):  # it has ended, and another runs
            resource.prlimit(pid, what, before)


def _short_of_memory(rig: ChaosRig) -> Window:
    """No new memory at all: what is mapped now is all there is."""
    pid = rig.manager.pid
    in_use = int(Path(f"/proc/{pid}/statm").read_text().split()[0]) * resource.getpagesize()
    return _during(2.0, _limited(pid, resource.RLIMIT_AS, in_use))


def _disk_full(rig: ChaosRig) -> Window:
    """No file may grow beyond 100 kB: writes fail as on a full disk."""
    window = _during(2.0, _limited(rig.manager.pid, resource.RLIMIT_FSIZE, 100_000))
    wait_until(lambda: any(event.body["kind"] == "recording_stopped" for event in rig.subscriber.events), 10.0)
    return window


def _router_restarted(rig: ChaosRig) -> Window:
    assert rig.router is not None
    window = window_from_now(0.0)
    rig.router.kill()
    time.sleep(1.0)
    rig.router.start()
    return Window((), "", window.from_ns, time.monotonic_ns())


_SUBSCRIBER = """
import sys, time
from ghest_rt.security.session import open_session
session, _ = open_session(connect=(sys.argv[1],))
subscriber = session.declare_subscriber("ghest/**", lambda sample: None)
print("ready", flush=True)
time.sleep(1e6)
"""


def _subscriber_stuck(rig: ChaosRig) -> Window:
    """Another subscriber's process is stopped with the connection open."""
    other = subprocess.Popen([sys.executable, "-c", _SUBSCRIBER, rig.endpoint], cwd=ROOT, stdout=subprocess.PIPE, text=True)
    try:
        assert other.stdout is not None
        assert other.stdout.readline() == "ready\n"
        return _during(4.0, held(other.pid))
    finally:
        other.kill()
        other.communicate()


def _wall_clock(offset_s: float = 0.0, slew_ppm: float = 0.0) -> Inflict:
    def turn(rig: ChaosRig) -> Window:
        assert rig.wall_clock is not None
        window = window_from_now(0.0)
        rig.wall_clock.turn(offset_s, slew_ppm)
        time.sleep(1.5)
        rig.wall_clock.turn()
        time.sleep(0.5)
        return Window((), "", window.from_ns, time.monotonic_ns())

    return turn


CHAOS = (
    Chaos("service stopped (SIGSTOP, SIGCONT), shorter than the watchdog's patience", _stopped(0.6)),
    Chaos("service stopped, longer than that", _stopped(2.0)),
    Chaos("service killed (SIGKILL)", _killed),
    Chaos("event loop hangs in a tick", _hung),
    Chaos("camera process stopped (SIGSTOP, SIGCONT)", _camera_stopped),
    Chaos("camera process killed", _camera_killed),
    Chaos("encoder box stopped; sends all it missed in a burst", _encoder_box_stopped),
    Chaos("processors starved: four busy processes per core", _starved),
    Chaos("no memory to be had (RLIMIT_AS)", _short_of_memory),
    Chaos("another subscriber stuck (SIGSTOP)", _subscriber_stuck, seen_through=True),
    Chaos("wall clock steps by an hour and back", _wall_clock(3600.0), "wall clock", seen_through=True),
    Chaos("wall clock steps back by a day and forth", _wall_clock(-86400.0), "wall clock", seen_through=True),
    Chaos("wall clock slews by 500 ppm", _wall_clock(slew_ppm=500.0), "wall clock", seen_through=True),
    Chaos("disk full while recording", _disk_full, "recording", seen_through=True),
    Chaos("Zenoh router killed, back after 1 s", _router_restarted, "routed"),
)
