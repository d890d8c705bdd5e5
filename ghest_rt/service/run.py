"""Run a service in this process until it ends or a signal asks it to."""

import asyncio
import importlib.util
import logging
from collections.abc import Callable

from ghest_rt.service.contract import ServiceSummary
from ghest_rt.service.loop import Service
from ghest_rt.service.process import punctual_process
from ghest_rt.service.stop_signals import StopSignals

_log = logging.getLogger(__name__)


def run_service(service: Service, stop: StopSignals, duration_s: float | None = None) -> ServiceSummary:
    """Run to the end, until a signal comes, or for `duration_s`.

    Raises:
        GhestError: As `Service.run`.
    """
    with punctual_process() as achieved:
        loop_factory = _uvloop_factory()
        achieved.append("uvloop" if loop_factory else "asyncio's own event loop (the extra `rt` brings uvloop)")
        _log.debug("timing: %s", "; ".join(achieved))
        with asyncio.Runner(loop_factory=loop_factory) as runner:
            return runner.run(_until_stopped(service, stop, duration_s))


async def _until_stopped(service: Service, stop: StopSignals, duration_s: float | None) -> ServiceSummary:
    loop = asyncio.get_running_loop()
    if duration_s is not None:
        loop.call_later(duration_s, service.stop)
    with stop.calling(lambda: loop.call_soon_threadsafe(service.stop)):
        return await service.run()


def _uvloop_factory() -> Callable[[], asyncio.AbstractEventLoop] | None:
    if importlib.util.find_spec("uvloop") is None:
        return None
    import uvloop  # noqa: PLC0415  (optional: the extra `rt`)

    factory: Callable[[], asyncio.AbstractEventLoop] = uvloop.new_event_loop
    return factory
