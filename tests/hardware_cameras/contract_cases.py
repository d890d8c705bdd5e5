"""Hardware camera backends for the contract suite: the vendor's own library where it is installed, no device."""

import contextlib
import importlib
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.hardware.supervisor.camera import SupervisedCamera
from ghest_drivers.hardware.supervisor.link import Limits
from ghest_drivers.hardware.supervisor.protocol import BackendSpec
from ghest_drivers.interfaces import RgbdCamera

FAKES = Path(__file__).parent / "fakes"


@contextmanager
def _sending(send: Callable[[int], object], silent: bool) -> Iterator[None]:
    """Call `send(k)` every 4 ms, unless silent."""
    stop = threading.Event()

    def run() -> None:
        k = 0
        while not stop.wait(0.004):
            k += 1
            send(k)

    thread = threading.Thread(target=run)
    if not silent:
        thread.start()
    yield
    stop.set()
    if not silent:
        thread.join()


@contextmanager
def realsense_camera(silent: bool) -> Iterator[RgbdCamera]:
    from ghest_drivers.hardware.realsense.camera import RealsenseCamera
    from ghest_drivers.hardware.realsense.software import SoftwareRealsense
    from ghest_drivers.hardware.realsense.source import ConnectedDevice
    from ghest_drivers.hardware.realsense.timestamps import TimeDomain
    from tests.hardware_cameras.realsense_rig import INFO, SETTINGS, color_of, depth_of

    clock = MonotonicClock()
    device = SoftwareRealsense(INFO)
    context = device.context()

    def send(k: int) -> None:
        t_ns = clock.now_ns() - 1_000_000_000
        device.send_depth(depth_of(k), k, t_ns, TimeDomain.HARDWARE)
        device.send_color(color_of(k), k, t_ns, TimeDomain.HARDWARE)

    source = ConnectedDevice("S1", 0, lambda: 0)
    with _sending(send, silent):
        yield RealsenseCamera("r0", source, SETTINGS, clock, context=lambda: context)


@contextmanager
def oak_camera(silent: bool) -> Iterator[RgbdCamera]:
    from ghest_drivers.hardware.oak.camera import OakCamera
    from ghest_drivers.hardware.oak.sdk import dai
    from tests.hardware_cameras.oak_rig import SETTINGS, HostSource, color_of, depth_of, image

    source = HostSource()

    def send(k: int) -> None:
        if not source.live.is_set():
            return
        with contextlib.suppress(dai.MessageQueue.QueueException):  # closed meanwhile
            now = dai.Clock.now()
            source.color.send(image(color_of(0), k, now))
            source.depth.send(image(depth_of(0), k, now))

    with _sending(send, silent):
        yield OakCamera("r0", source, SETTINGS, MonotonicClock())


@contextmanager
def supervised_camera(silent: bool) -> Iterator[RgbdCamera]:
    sys.path.insert(0, str(FAKES))
    settings = {"then": "silence", "frames": 1} if silent else {"then": "end", "frames": 20}
    limits = Limits(silence_s=600.0)
    yield SupervisedCamera("r0", BackendSpec("ghest_fake_cameras", "FakeCamera", settings), MonotonicClock(), limits)
    sys.path.remove(str(FAKES))


def installed(library: str) -> bool:
    """Whether a vendor library is installed, with the system libraries that it needs."""
    os.environ.setdefault("DEPTHAI_LEVEL", "error")
    try:
        importlib.import_module(library)
    except ImportError:
        return False
    return True
