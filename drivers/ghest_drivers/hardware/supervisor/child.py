"""The camera's process: opens the backend and copies its frames into the ring until told to stop."""

import contextlib
import faulthandler
import importlib
import logging
import os
import signal
import threading
from multiprocessing.connection import Connection
from typing import Any

from ghest_drivers.clock import MonotonicClock
from ghest_drivers.errors import BadDeviceData, DriverError, ReadTimeout
from ghest_drivers.hardware.supervisor.protocol import Attach, BackendSpec, Opened, Problem
from ghest_drivers.hardware.supervisor.ring import FrameRing
from ghest_drivers.interfaces import TellsVitals

_log = logging.getLogger(__name__)
_READ_TIMEOUT_S = 0.1
_VITALS_EVERY_NS = 1_000_000_000


def run(name: str, spec: BackendSpec, control: Connection, wake: Connection, reset: bool) -> None:
    """Be the process. The service alone decides when it ends; Ctrl-C at the terminal reaches both."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    faulthandler.enable()
    os.set_blocking(wake.fileno(), False)
    try:
        camera = _make(name, spec)
        if reset:
            _reset(camera)
        camera.open()
        control.send(Opened(camera.info))
        attach = control.recv()
    except DriverError as error:
        control.send(Problem.of(error))
        return
    except (EOFError, OSError):
        return
    if not isinstance(attach, Attach):
        camera.close()
        return
    stop = threading.Event()
    threading.Thread(target=_listen, args=(control, stop), daemon=True).start()
    _stream(camera, FrameRing(attach.layout, attach.ring_name), control, wake, stop)
    camera.close()


def _make(name: str, spec: BackendSpec) -> Any:
    module = importlib.import_module(spec.module)
    return getattr(module, spec.maker)(name=name, clock=MonotonicClock(), **spec.settings)


def _reset(camera: Any) -> None:
    reset = getattr(camera, "reset", None)
    if reset is not None:
        try:
            reset()
        except Exception as error:  # a device that cannot be reset, or refuses it, may open all the same
            _log.warning("hardware reset: %s", error)


def _stream(camera: Any, ring: FrameRing, control: Connection, wake: Connection, stop: threading.Event) -> None:
    clock = MonotonicClock()
    vitals_due_ns = 0
    while not stop.is_set():
        try:
            ring.put(camera.read(_READ_TIMEOUT_S))
            if clock.now_ns() >= vitals_due_ns and isinstance(camera, TellsVitals):
                vitals_due_ns = clock.now_ns() + _VITALS_EVERY_NS
                control.send(camera.vitals())
        except ReadTimeout:
            continue
        except (BadDeviceData, ValueError) as error:
            control.send(Problem(BadDeviceData.__name__, str(error)))
        except Exception as error:  # whatever the vendor's code raises ends this process, and is told
            control.send(Problem.of(error))
            return
        with contextlib.suppress(BlockingIOError):  # full: the service has plenty to wake up for
            os.write(wake.fileno(), b"\0")


def _listen(control: Connection, stop: threading.Event) -> None:
    """Wait for the word to stop. If the service has died there is nobody to close for."""
    try:
        control.recv()
    except (EOFError, OSError):
        os._exit(1)
    stop.set()
