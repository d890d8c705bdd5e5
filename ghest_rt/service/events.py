"""Telling what happens: to the log and to everybody who listens."""

import logging
from collections.abc import Sequence

from ghest_drivers.clock import Clock
from ghest_rt.messages.published import Event, EventKind
from ghest_rt.service.compose import AnglesComposer
from ghest_rt.service.inputs import Severity
from ghest_rt.service.outputs import Output

_log = logging.getLogger(__name__)

_LEVELS = {"info": logging.INFO, "warning": logging.WARNING, "error": logging.ERROR}


class EventTeller:
    """Logs and publishes events; on the event loop's thread."""

    def __init__(self, composer: AnglesComposer, outputs: Sequence[Output], clock: Clock) -> None:
        """Prepare.

        Args:
            composer: Numbers the messages and knows Unix time.
            outputs: Who is told.
            clock: The service's clock.
        """
        self._composer = composer
        self._outputs = outputs
        self._clock = clock

    def tell(self, kind: EventKind, severity: Severity, source: str, text: str) -> None:
        """Tell of something that has just happened.

        Args:
            kind: What.
            severity: How grave it is.
            source: To what it happened.
            text: In words, for people.
        """
        fields = {"ghest_source": source, "ghest_kind": str(kind)}
        _log.log(_LEVELS[severity], "%s: %s: %s", source, kind.replace("_", " "), text, extra=fields)
        t_ns = self._clock.now_ns()
        message = Event(
            run_id=self._composer.numbering.run_id,
            seq=self._composer.numbering.take("events"),
            t_ns=t_ns,
            t_unix_ns=self._composer.unix_ns(t_ns),
            severity=severity,
            kind=kind,
            source=source,
            message=text,
        )
        for output in self._outputs:
            output.event(message)
