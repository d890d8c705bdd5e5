"""Run a service in this process until it ends or a signal asks it to."""

import asyncio
import importlib.util
import logging
import signal
from collections.abc import Callable
from dataclasses import dataclass

from ghest_rt.service.loop import Service, ServiceSummary
from ghest_rt.service.process import punctual_process

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class RunResult:
    """How a run ended.

    Attributes:
        summary: What it came to.
        interrupted: Whether a signal ended it.
    """

    summary: ServiceSummary
    interrupted: bool


def run_service(service: Service) -> RunResult:
    """Run to the end, or until SIGINT or SIGTERM.

    Raises:
        GhestError: As `Service.run`.
    """
    with punctual_process() as achieved:
        loop_factory = _uvloop_factory()
        achieved.append("uvloop" if loop_factory else "asyncio's own event loop (the extra `rt` brings uvloop)")
        _log.info("timing: %s", "; ".join(achieved))
        with asyncio.Runner(loop_factory=loop_factory) as runner:
            return runner.run(_until_signal(service))


async def _until_signal(service: Service) -> RunResult:
    loop = asyncio.get_running_loop()
    received: list[signal.Signals] = []

    def stop(number: signal.Signals) -> None:
        _log.info("%s: stopping", number.name)
        received.append(number)
        service.stop()

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop, number)
    try:
        summary = await service.run()
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
    return RunResult(summary, bool(received))


def _uvloop_factory() -> Callable[[], asyncio.AbstractEventLoop] | None:
    if importlib.util.find_spec("uvloop") is None:
        return None
    import uvloop  # noqa: PLC0415  (optional: the extra `rt`)

    factory: Callable[[], asyncio.AbstractEventLoop] = uvloop.new_event_loop
    return factory
